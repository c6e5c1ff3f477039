// Modbus frames: the PDU between address and check value of a serial line, or behind the header of
// a TCP connection. PDUs come from the builders below and go to the line, frames come back from the
// frame rules.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "config/model/modbus.h"
#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::protocols::modbus {

// Builders of Modbus requests, function code and data, the same in both framings. Codes, lengths
// and checks: protocols/modbus_pdu/modbus_pdu.h.

using namespace baudgate::modbus;  // the rules that the gateway shares

Bytes ReadRequest(std::uint8_t function, std::uint16_t address, std::size_t count);
Bytes WriteCoilRequest(std::uint16_t address, bool on);
Bytes WriteCoilsRequest(std::uint16_t address, const std::vector<bool>& bits);
Bytes WriteRegisterRequest(std::uint16_t address, std::uint16_t value);
Bytes WriteRegistersRequest(std::uint16_t address, const std::vector<std::uint16_t>& values);
Bytes MaskWriteRequest(std::uint16_t address, std::uint16_t keep, std::uint16_t set);
/// Sub-function 0: the device sends the same back.
Bytes LoopbackRequest(std::uint16_t data);

void AppendU16(Bytes& to, std::size_t value);
/// High byte first.
Bytes BytesOf(const std::vector<std::uint16_t>& words);
/// Eight to a byte, the first in bit 0.
Bytes PackBits(const std::vector<bool>& bits);

using config::kLastSlave;

// rtu    address, PDU, CRC-16 low byte first
// ascii  ':', address, PDU and LRC in hex, CR LF
// tcp    transaction, protocol (0), length of what follows (2 bytes each), unit, PDU. Source:
// MODBUS
//        Messaging on TCP/IP Implementation Guide V1.0b, 3.1.3
using baudgate::modbus::Framing;

inline constexpr std::size_t kRtuOverhead = 3;
inline constexpr std::size_t kMaxRtu = 256;
inline constexpr std::size_t kMaxAscii = 513;
inline constexpr std::size_t kTcpOverhead = 7;
inline constexpr std::size_t kMaxTcp = 260;
/// What the length of a header counts beside the PDU: the unit.
inline constexpr std::size_t kTcpCounted = 1;

/// Characters of a whole frame around so many bytes of PDU; of ASCII with its line feed.
std::size_t FrameLength(Framing framing, std::size_t pdu);
std::size_t MaxFrame(Framing framing);

struct Adu {
  std::uint8_t slave = 0;
  Bytes pdu;                      ///< never empty
  std::uint16_t transaction = 0;  ///< of tcp: in a request, and in its reply
};

/// `transaction`: of tcp.
Bytes Wrap(Framing framing, std::uint8_t slave, View pdu, std::uint16_t transaction = 0);
/// Nothing unless the whole frame is one with a good check value.
std::optional<Adu> Unwrap(Framing framing, View frame);
/// The same for a frame that a reply rule has cut: the header of a Modbus TCP server may count too
/// many bytes.
std::optional<Adu> UnwrapReply(Framing framing, View frame);

/// Size of the frame that the header begins, of which there are at least six bytes. Empty: it is
/// no header of Modbus TCP.
std::optional<std::size_t> TcpSize(View header);
/// Nobody answers a request to this slave. A TCP server may itself have the unit 0.
constexpr bool IsBroadcast(Framing framing, std::uint8_t slave) {
  return slave == 0 && framing != Framing::tcp;
}

/// "20" or "0x14": 1…247; of tcp 0…255.
Result<std::uint8_t> ParseAddress(std::string_view text, Framing framing = Framing::rtu);
/// Decimal, or hex with 0x.
std::optional<std::uint16_t> ParseNumber(std::string_view text);

}  // namespace baudgate::protocols::modbus
