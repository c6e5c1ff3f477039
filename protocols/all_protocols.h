// Every protocol that the list in protocols/CMakeLists.txt names, in one process: for tests and
// fuzz targets. The daemon knows none of them; it loads modules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "protocols/protocol.h"

namespace baudgate::protocols {

/// In the order of the list.
const std::vector<const Protocol*>& AllProtocols();

/// Null: no protocol of that name.
const Protocol* FindProtocol(std::string_view name);

}  // namespace baudgate::protocols
