// `baudgate run`: runs the daemon in the foreground until SIGTERM or SIGINT; SIGHUP reloads the
// file, SIGUSR1 and SIGUSR2 are ignored. RunDiscoveryServer and RunWatch run the DDS programs.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "gateway/daemon/reloader.h"

namespace baudgate::tools {

/// Exit codes: 0 stopped in order; 3 bad configuration; 4 an output cannot be opened, or a slow
/// stop.
int RunDaemon(const std::string& file, const config::Catalog& catalog);

/// Runs a gateway with this configuration until SIGTERM or SIGINT. Without `reload` there is no
/// file to reload. Exit codes as for RunDaemon.
int Serve(config::Config config, std::optional<daemon::ReloadOptions> reload,
          const config::Catalog& catalog);

// `baudgate discovery-server`: introduces DDS participants to each other without multicast.

/// Runs until SIGTERM or SIGINT. `listen` is HOST:PORT. Exit codes: 0 stopped; 2 `listen` is no
/// address; 4 the address cannot be opened.
int RunDiscoveryServer(const std::string& listen, std::ostream& err);

// `baudgate watch`: replaces this process by baudgate-dds, because this binary has no DDS library.

/// Does not return on success; returns 4 if baudgate-dds is missing. `words`: those behind "watch".
/// The points of installed profiles are passed on, too (gateway/tools/watch/point_image.h).
int RunWatch(const std::vector<std::string>& words, const config::Catalog& catalog,
             std::ostream& err);

}  // namespace baudgate::tools
