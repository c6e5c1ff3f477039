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
  bool last = false;                  ///< the flight recorder, not new frames
  bool bytes = false;                 ///< each arrival separately, not decoded
  std::optional<Duration> seconds{};  ///< empty: ends at SIGINT or SIGTERM
  std::string socket{};  ///< empty: the only gateway that answers in the default places
};

/// Flushes each record. Exit codes: 0, also when the gateway stops; 2 unknown line or device; 4 no
/// gateway.
int RunTrace(const TraceOptions& options, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err);

}  // namespace baudgate::tools
