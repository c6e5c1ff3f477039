// `AllProtocols` and FindProtocol give tests and fuzz targets all protocols that
// protocols/CMakeLists.txt lists, linked into one program. The daemon does not use them: it loads
// modules.
#pragma once

#include <string_view>
#include <vector>

#include "protocols/protocol.h"

namespace baudgate::protocols {

const std::vector<const Protocol*>& AllProtocols();

const Protocol* FindProtocol(std::string_view name);

}  // namespace baudgate::protocols
