// `baudgate run`: the daemon in the foreground, until SIGTERM or SIGINT. SIGHUP has the file
// read again; SIGUSR1 and SIGUSR2 are ignored.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "gateway/daemon/reloader.h"

namespace baudgate {

/// Exit codes: 0 stopped in order, 3 bad configuration, 4 an output could not be opened, or the
/// stop took too long.
int RunDaemon(const std::string& file, const config::Catalog& catalog);

/// A gateway with this configuration, until SIGTERM or SIGINT. Without `reload` it has no file that
/// could be read again. Exit codes as above.
int Serve(config::Config config, std::optional<ReloadOptions> reload,
          const config::Catalog& catalog);

}  // namespace baudgate
