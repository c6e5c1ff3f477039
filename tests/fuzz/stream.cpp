// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/stream.h"

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"

namespace baudgate::fuzz {
namespace {

constexpr std::uint8_t kLength = 0x3F;
constexpr std::uint8_t kSeal = 0x40;
constexpr std::uint8_t kCut = 0x80;

bool HasCrc(const protocols::Protocol& protocol) {
  return protocol.name == "set4tm" || protocol.name == "modbus_rtu";
}

bool IsKs(const protocols::Protocol& protocol, int checksum) {
  return protocol.name == "set4tm" && checksum == 1;
}

/// Modbus TCP has no check value, so a correct length in the header makes a frame valid.
void SealTcp(Bytes& bytes, std::size_t from) {
  const std::size_t size = bytes.size() - from;
  if (size < 6) return;
  bytes[from + 4] = static_cast<std::uint8_t>((size - 6) >> 8U);
  bytes[from + 5] = static_cast<std::uint8_t>(size - 6);
}

/// Appends the LRC of the bytes that the hex text behind ':' encodes.
void SealAscii(Bytes& bytes, View covered) {
  const std::string_view text = AsText(covered);
  const auto start = text.find(':');
  const auto decoded = ParseHex(start == std::string_view::npos ? text : text.substr(start + 1));
  Append(bytes, HexByte(static_cast<std::uint8_t>(0x100U - Sum8(decoded.value_or(Bytes())))));
  Append(bytes, "\r\n");
}

}  // namespace

void Seal(const protocols::Protocol& protocol, Bytes& bytes, std::size_t from, int checksum) {
  View covered = View(bytes).subspan(from);
  if (IsKs(protocol, checksum)) {
    bytes.push_back(static_cast<std::uint8_t>(0xFFU ^ Xor8(covered)));
    return;
  }
  if (HasCrc(protocol)) {
    const std::uint16_t crc = Crc16(covered);
    bytes.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
    bytes.push_back(static_cast<std::uint8_t>(crc >> 8U));
    return;
  }
  if (protocol.name == "modbus_tcp") return SealTcp(bytes, from);
  if (protocol.name == "modbus_ascii") return SealAscii(bytes, covered);
  if (protocol.name == "spabus") {
    const auto start = AsText(covered).find_first_of("<>");
    if (start != std::string_view::npos) covered = covered.subspan(start);
    Append(bytes, HexByte(Xor8(covered)));
    Append(bytes, "\r\n");
    return;
  }
  Append(bytes, HexByte(Sum8(covered)));
  Append(bytes, "\r");
}

void Unseal(const protocols::Protocol& protocol, Bytes& frame, int checksum) {
  if (protocol.name == "modbus_tcp") return;
  std::size_t keep = frame.size();
  if (protocol.name == "spabus") {
    const auto colon = AsText(frame).rfind(':');
    if (colon != std::string_view::npos) keep = colon + 1;
  } else {
    std::size_t check = HasCrc(protocol) ? 2 : protocol.name == "modbus_ascii" ? 4 : 3;
    if (IsKs(protocol, checksum)) check = 1;
    keep -= std::min(keep, check);
  }
  frame.resize(keep);
}

Stream TakeStream(const protocols::Protocol& protocol, Input& input) {
  Stream stream;
  std::size_t sealed = 0;
  while (!input.empty()) {
    const std::uint8_t head = input.U8();
    Append(stream.bytes, input.Take(head & kLength));
    if ((head & kSeal) != 0) {
      Seal(protocol, stream.bytes, sealed);
      sealed = stream.bytes.size();
    }
    if ((head & kCut) != 0) stream.cuts.push_back(stream.bytes.size());
  }
  return stream;
}

}  // namespace baudgate::fuzz
