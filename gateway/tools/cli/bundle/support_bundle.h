// `baudgate support-bundle`: status, traces, log, configuration and versions in one archive for a
// bug report; no secret is in it. Without a running gateway it has less, and says what is missing.
// SystemLog is the log of the service.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

// The log of the service, as systemd keeps it.

/// The newest lines of baudgate and baudgate-dds. The error says why there are none.
Result<std::string> SystemLog();

struct BundleOptions {
  std::string file{};    ///< a new one: tar.gz
  std::string config{};  ///< empty: that of the running gateway, else the one of the service
  std::string socket{};  ///< empty: the gateway in the default places
  std::function<Result<std::string>()> log = SystemLog;
};

/// Exit codes: 0 it is written, whatever is missing in it; 4 it cannot be written, or is there.
int RunSupportBundle(const BundleOptions& options, const config::Catalog& catalog, WallTime now,
                     std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
