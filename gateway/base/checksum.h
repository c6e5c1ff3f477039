// The check values that serial protocols use, each in one place.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/bytes.h"

namespace baudgate {

/// CRC-16/MODBUS: reflected polynomial 0xA001, start 0xFFFF, no final XOR. Check("123456789") =
/// 0x4B37.
std::uint16_t Crc16(View bytes);

/// Sum of all bytes modulo 256 (DCON).
std::uint8_t Sum8(View bytes);

/// Exclusive-or of all bytes (SPA Bus).
std::uint8_t Xor8(View bytes);

}  // namespace baudgate
