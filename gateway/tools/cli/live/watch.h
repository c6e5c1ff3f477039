// `baudgate watch` as the gateway's binary does it: hands over to baudgate-dds, as it links no DDS
// library itself.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate {

/// Does not return when all is well. `words` are those behind "watch"; 4: there is no baudgate-dds.
/// The points of installed profiles go with them (gateway/tools/watch/point_order.h).
int RunWatch(const std::vector<std::string>& words, const config::Catalog& catalog,
             std::ostream& err);

}  // namespace baudgate
