// `baudgate run`: the daemon in the foreground, until SIGTERM or SIGINT. SIGHUP has the file
// read again; SIGUSR1 and SIGUSR2 are ignored. RunDiscoveryServer and RunWatch are the programs of
// DDS.
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

/// Exit codes: 0 stopped in order, 3 bad configuration, 4 an output could not be opened, or the
/// stop took too long.
int RunDaemon(const std::string& file, const config::Catalog& catalog);

/// A gateway with this configuration, until SIGTERM or SIGINT. Without `reload` it has no file that
/// could be read again. Exit codes as above.
int Serve(config::Config config, std::optional<daemon::ReloadOptions> reload,
          const config::Catalog& catalog);

// `baudgate discovery-server`: introduces DDS participants to each other where multicast does not
// reach. Links no DDS library. RunWatch hands over to baudgate-dds.

/// Until SIGTERM or SIGINT. `listen` is HOST:PORT. Exit codes: 0 stopped, 2 not an address, 4 it
/// cannot be opened.
int RunDiscoveryServer(const std::string& listen, std::ostream& err);

// `baudgate watch` as the gateway's binary does it: hands over to baudgate-dds, as it links no DDS
// library itself.

/// Does not return when all is well. `words` are those behind "watch"; 4: there is no baudgate-dds.
/// The points of installed profiles go with them (gateway/tools/watch/point_image.h).
int RunWatch(const std::vector<std::string>& words, const config::Catalog& catalog,
             std::ostream& err);

}  // namespace baudgate::tools
