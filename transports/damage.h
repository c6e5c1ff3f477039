// What stands in the place of a character that arrived damaged (parity, framing, break).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace baudgate {

/// Not dropped: without a checksum ">+12.3" with one digit missing is still a valid number. 0xFF is
/// no character of any ASCII protocol, and one changed byte never passes a CRC-16.
inline constexpr std::uint8_t kDamaged = 0xFF;

}  // namespace baudgate
