// `baudgate trace`: the frames of one line as they come and go, or what the flight recorder holds.
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
  std::string device{};               ///< only its records; empty: all
  bool last = false;                  ///< what has been, instead of what comes
  bool bytes = false;                 ///< each arrival of bytes as it was, nothing decoded
  std::optional<Duration> seconds{};  ///< end after this time; empty: at SIGINT or SIGTERM
  std::string socket{};               ///< empty: the gateway in the default places
};

/// Each record is flushed, so that it can be piped. Exit code 0, also when the gateway stops; 2 for
/// an unknown line or device; 4 when no gateway answers.
int RunTrace(const TraceOptions& options, const config::Catalog& catalog, std::ostream& out,
             std::ostream& err);

}  // namespace baudgate::tools
