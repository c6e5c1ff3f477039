// The number in front of a Modbus TCP frame, another one for each request.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "gateway/base/bytes.h"
#include "protocols/protocol.h"

namespace baudgate {

/// Its bytes; 0: frames of this protocol have none.
inline std::size_t TransactionBytes(const Protocol& protocol) { return protocol.tcp ? 2 : 0; }

/// The frame with zeros in place of its number: two requests that ask the same are equal.
inline Bytes WithoutNumber(const Protocol& protocol, View frame) {
  Bytes same(frame.begin(), frame.end());
  std::fill_n(same.begin(), std::min(same.size(), TransactionBytes(protocol)), std::uint8_t{0});
  return same;
}

}  // namespace baudgate
