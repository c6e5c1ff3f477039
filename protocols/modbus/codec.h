// Builds and parses Modbus frames. A frame wraps a PDU (function code and data) for a serial line
// (address and check value) or for a TCP connection (header).
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

// The functions below build the PDUs of requests. protocols/modbus_pdu/modbus_pdu.h has the
// function codes, lengths and checks.

using namespace baudgate::modbus;  // rules of Modbus that the gateway also uses

Bytes ReadRequest(std::uint8_t function, std::uint16_t address, std::size_t count);
Bytes WriteCoilRequest(std::uint16_t address, bool on);
Bytes WriteCoilsRequest(std::uint16_t address, const std::vector<bool>& bits);
Bytes WriteRegisterRequest(std::uint16_t address, std::uint16_t value);
Bytes WriteRegistersRequest(std::uint16_t address, const std::vector<std::uint16_t>& values);
Bytes MaskWriteRequest(std::uint16_t address, std::uint16_t keep, std::uint16_t set);
/// Builds a loopback request (function 8, subfunction 0): the device returns the same data.
Bytes LoopbackRequest(std::uint16_t data);

void AppendU16(Bytes& to, std::size_t value);
/// Returns the registers as bytes, high byte first.
Bytes BytesOf(const std::vector<std::uint16_t>& words);
/// Packs bits into bytes, eight in each; the first bit is bit 0.
Bytes PackBits(const std::vector<bool>& bits);

using config::kLastSlave;

// The frame of each framing:
//
//   rtu    address, PDU, CRC-16 low byte first
//   ascii  ':', address, PDU and LRC in hex, CR LF
//   tcp    transaction, protocol (0), length of the rest (2 bytes each), unit, PDU
//
// Source: MODBUS Messaging on TCP/IP Implementation Guide V1.0b, 3.1.3
using baudgate::modbus::Framing;

inline constexpr std::size_t kRtuOverhead = 3;
inline constexpr std::size_t kMaxRtu = 256;
inline constexpr std::size_t kMaxAscii = 513;
inline constexpr std::size_t kTcpOverhead = 7;
inline constexpr std::size_t kMaxTcp = 260;
/// The length in a TCP header counts the unit and the PDU: this many bytes more than the PDU.
inline constexpr std::size_t kTcpCounted = 1;

/// Returns the length of the whole frame that contains a PDU of `pdu` bytes; for ASCII in
/// characters, CR LF included.
std::size_t FrameLength(Framing framing, std::size_t pdu);
std::size_t MaxFrame(Framing framing);

struct Adu {
  std::uint8_t slave = 0;
  Bytes pdu;                      ///< function code and data; never empty
  std::uint16_t transaction = 0;  ///< tcp only: the number of a request, which its reply repeats
};

/// Makes a whole frame. `transaction` is used for tcp only.
Bytes Wrap(Framing framing, std::uint8_t slave, View pdu, std::uint16_t transaction = 0);
/// Parses a whole frame. Returns nothing unless the frame is valid and its check value is correct.
std::optional<Adu> Unwrap(Framing framing, View frame);
/// Parses a frame that a reply rule has cut. Unlike Unwrap it accepts a tcp frame whose header
/// gives a length greater than that of the frame, because some servers count wrong.
std::optional<Adu> UnwrapReply(Framing framing, View frame);

/// Returns the size of the frame whose header begins with `header`. Empty: `header` has fewer than
/// six bytes or is not a Modbus TCP header.
std::optional<std::size_t> TcpSize(View header);
/// True if a request to `slave` is a broadcast, which no slave answers. With tcp, unit 0 is an
/// ordinary address.
constexpr bool IsBroadcast(Framing framing, std::uint8_t slave) {
  return slave == 0 && framing != Framing::tcp;
}

/// Parses an address: 1…247, for tcp 0…255; in decimal ("20") or hex ("0x14").
Result<std::uint8_t> ParseAddress(std::string_view text, Framing framing = Framing::rtu);
/// Parses a number in decimal, or in hex with 0x.
std::optional<std::uint16_t> ParseNumber(std::string_view text);

}  // namespace baudgate::protocols::modbus
