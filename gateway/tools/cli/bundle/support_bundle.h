// `baudgate support-bundle`: packs status, traces, log, configuration and versions into one archive
// for a bug report. The archive contains no secrets. Without a running gateway it contains less.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

/// Returns the newest log lines of baudgate and baudgate-dds, or the reason why there are none.
Result<std::string> SystemLog();

struct BundleOptions {
  std::string file{};  ///< the archive to write (tar.gz); it must not exist yet
  /// The configuration file; empty: the file of the running gateway, else the file of the service.
  std::string config{};
  std::string socket{};  ///< path of the control socket; empty: the only running gateway is used
  std::function<Result<std::string>()> log = SystemLog;
};

/// Exit codes: 0 written, even if parts are missing; 4 the file exists or cannot be written.
int RunSupportBundle(const BundleOptions& options, const config::Catalog& catalog, WallTime now,
                     std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
