// `baudgate watch` as the gateway's binary does it: hands over to baudgate-dds, as it links no DDS
// library itself.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace baudgate {

/// Does not return when all is well. `words` are those behind "watch"; 4: there is no baudgate-dds.
int RunWatch(const std::vector<std::string>& words, std::ostream& err);

}  // namespace baudgate
