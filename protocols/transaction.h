// The number in front of a Modbus TCP frame, another one for each request.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "protocols/protocol.h"

namespace baudgate {

/// Its bytes; 0: frames of this protocol have none.
inline std::size_t TransactionBytes(const Protocol& protocol) { return protocol.tcp ? 2 : 0; }

}  // namespace baudgate
