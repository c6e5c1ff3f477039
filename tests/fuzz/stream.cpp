// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/stream.h"

#include "gateway/base/checksum.h"
#include "gateway/base/text.h"

namespace baudgate::fuzz {
namespace {

constexpr std::uint8_t kLength = 0x3F;
constexpr std::uint8_t kSeal = 0x40;
constexpr std::uint8_t kCut = 0x80;

}  // namespace

void Seal(const Protocol& protocol, Bytes& bytes, std::size_t from) {
  View covered = View(bytes).subspan(from);
  if (protocol.name == "set4tm") {
    const std::uint16_t crc = Crc16(covered);
    bytes.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
    bytes.push_back(static_cast<std::uint8_t>(crc >> 8U));
    return;
  }
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

void Unseal(const Protocol& protocol, Bytes& frame) {
  std::size_t keep = frame.size();
  if (protocol.name == "spabus") {
    const auto colon = AsText(frame).rfind(':');
    if (colon != std::string_view::npos) keep = colon + 1;
  } else {
    keep -= std::min<std::size_t>(keep, protocol.name == "set4tm" ? 2 : 3);
  }
  frame.resize(keep);
}

Stream TakeStream(const Protocol& protocol, Input& input) {
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
