// Modbus frames on a serial line: the PDU between address and check value, in both framings. PDUs
// come from pdu.h and go to the line, frames come back from the frame rules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "config/model/modbus_addresses.h"
#include "gateway/base/bytes.h"
#include "gateway/base/result.h"

namespace baudgate::protocols::modbus {

using config::kLastSlave;

enum class Framing : std::uint8_t {
  rtu,    ///< address, PDU, CRC-16 low byte first
  ascii,  ///< ':', address, PDU and LRC in hex, CR LF
};

inline constexpr std::size_t kRtuOverhead = 3;
inline constexpr std::size_t kMaxRtu = 256;
inline constexpr std::size_t kMaxAscii = 513;

/// Characters of a whole frame around so many bytes of PDU; of ASCII with its line feed.
std::size_t FrameLength(Framing framing, std::size_t pdu);
std::size_t MaxFrame(Framing framing);

struct Adu {
  std::uint8_t slave = 0;
  Bytes pdu;  ///< never empty
};

Bytes Wrap(Framing framing, std::uint8_t slave, View pdu);
/// Nothing unless the whole frame is one with a good check value.
std::optional<Adu> Unwrap(Framing framing, View frame);

/// "20" or "0x14": 1…247.
Result<std::uint8_t> ParseAddress(std::string_view text);
/// Decimal, or hex with 0x.
std::optional<std::uint16_t> ParseNumber(std::string_view text);

}  // namespace baudgate::protocols::modbus
