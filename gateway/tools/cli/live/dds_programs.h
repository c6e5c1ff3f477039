// `baudgate discovery-server`: introduces DDS participants to each other where multicast does not
// reach. Links no DDS library. RunWatch hands over to baudgate-dds.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate {

/// Until SIGTERM or SIGINT. `listen` is HOST:PORT. Exit codes: 0 stopped, 2 not an address, 4 it
/// cannot be opened.
int RunDiscoveryServer(const std::string& listen, std::ostream& err);

// `baudgate watch` as the gateway's binary does it: hands over to baudgate-dds, as it links no DDS
// library itself.

/// Does not return when all is well. `words` are those behind "watch"; 4: there is no baudgate-dds.
/// The points of installed profiles go with them (gateway/tools/watch/point_image.h).
int RunWatch(const std::vector<std::string>& words, const config::Catalog& catalog,
             std::ostream& err);

}  // namespace baudgate
