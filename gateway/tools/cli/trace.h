// `baudgate trace`: prints the frames on one line, or the content of the flight recorder.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

struct TraceOptions {
  std::string line{};
  std::string device{};
  bool last = false;   ///< true: print the frames of the flight recorder, not new frames
  bool bytes = false;  ///< true: print each arrival of bytes separately, not decoded
  std::optional<Duration> seconds{};  ///< ends after this time; empty: ends at SIGINT or SIGTERM
  std::string socket{};  ///< path of the control socket; empty: the only running gateway is used
};

/// Flushes the output after each record, for use in pipes. Exit codes: 0, also when the gateway
/// stops; 2 unknown line or device; 4 no gateway answers.
int RunTrace(const TraceOptions& options, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err);

}  // namespace baudgate::tools
