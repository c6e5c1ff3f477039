// `baudgate support-bundle`: packs status, traces, log, configuration and versions into one archive
// for a bug report. The archive contains no secrets. Without a running gateway it contains less,
// and lists what is missing. SystemLog returns the log of the service.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

/// Returns the newest log lines of baudgate and baudgate-dds from the systemd journal, or an error
/// with the reason why there are none.
Result<std::string> SystemLog();

struct BundleOptions {
  std::string file{};  ///< the archive to write (tar.gz); it must not exist yet
  /// The configuration file; empty: that of the running gateway, else that of the service.
  std::string config{};
  std::string socket{};  ///< empty: the gateway in the default places
  std::function<Result<std::string>()> log = SystemLog;
};

/// Exit codes: 0 the archive is written, even if parts are missing; 4 the file exists already or
/// cannot be written.
int RunSupportBundle(const BundleOptions& options, const config::Catalog& catalog, WallTime now,
                     std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
