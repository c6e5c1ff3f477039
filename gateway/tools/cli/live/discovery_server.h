// `baudgate discovery-server`: introduces DDS participants to each other where multicast does not
// reach. Links no DDS library.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>

namespace baudgate {

/// Until SIGTERM or SIGINT. `listen` is HOST:PORT. Exit codes: 0 stopped, 2 not an address, 4 it
/// cannot be opened.
int RunDiscoveryServer(const std::string& listen, std::ostream& err);

}  // namespace baudgate
