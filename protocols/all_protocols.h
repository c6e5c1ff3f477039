// The list of all protocols of protocols/CMakeLists.txt in one process, for tests and fuzz targets.
// The daemon does not use it: it loads modules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "protocols/protocol.h"

namespace baudgate::protocols {

const std::vector<const Protocol*>& AllProtocols();

/// Returns the protocol of that name; null if there is none.
const Protocol* FindProtocol(std::string_view name);

}  // namespace baudgate::protocols
