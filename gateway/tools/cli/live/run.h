// `baudgate run`: runs the daemon in the foreground until SIGTERM or SIGINT. SIGHUP reloads the
// file; SIGUSR1 and SIGUSR2 are ignored. RunDiscoveryServer and RunWatch run the DDS programs.
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

/// Runs the daemon with the configuration file. Exit codes: 0 stopped; 3 bad configuration; 4 an
/// output cannot be opened, the system has no free descriptor or thread, or the stop takes too
/// long.
int RunDaemon(const std::string& file, const config::Catalog& catalog);

/// Runs a gateway with this configuration until SIGTERM or SIGINT. If `reload` is empty, the
/// configuration cannot be reloaded. Returns the exit codes of RunDaemon.
int Serve(config::Config config, std::optional<daemon::ReloadOptions> reload,
          const config::Catalog& catalog);

// `baudgate discovery-server`: makes DDS participants known to each other without multicast.

/// Runs until SIGTERM or SIGINT. `listen` is HOST:PORT. Exit codes: 0 stopped; 2 `listen` is not an
/// address; 4 the address cannot be opened.
int RunDiscoveryServer(const std::string& listen, std::ostream& err);

// `baudgate watch`: this process becomes baudgate-dds, because this program does not contain the
// DDS library.

/// `words`: the words after "watch". The points of installed profiles are added
/// (gateway/tools/watch/point_image.h). Does not return on success; returns 4 if baudgate-dds
/// cannot be started.
int RunWatch(const std::vector<std::string>& words, const config::Catalog& catalog,
             std::ostream& err);

}  // namespace baudgate::tools
