// The check values that serial protocols use, each in one place.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/bytes.h"

namespace baudgate {

/// CRC-16/MODBUS: reflected polynomial 0xA001, start 0xFFFF, no final XOR. Check("123456789") =
/// 0x4B37.
std::uint16_t Crc16(View bytes);
/// Appends the CRC of `bytes` to them, low byte first.
void AppendCrc16(Bytes& bytes);
/// Whether the last two bytes are the CRC of those before, of which there is at least one.
bool EndsInCrc16(View frame);

/// Sum of all bytes modulo 256 (DCON).
std::uint8_t Sum8(View bytes);

/// Exclusive-or of all bytes (SPA Bus).
std::uint8_t Xor8(View bytes);

}  // namespace baudgate
