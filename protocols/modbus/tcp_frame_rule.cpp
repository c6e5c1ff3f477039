// Cuts Modbus TCP messages by the length in their header.
//
//   > 00 01 00 00 00 06 14 | 03 01 F4 00 01     transaction 1, unit 20: read holding 500
//   < 00 01 00 00 00 05 14 | 03 02 00 31        its value: 0031
//   < 00 01 00 00 00 03 14 | 83 02              exception in its place: illegal data address
//
// Where function and request fix the size of a reply and its header counts too many, the header is
// wrong, and the next message follows the size:
//
//   < 00 01 00 00 00 04 14 | 83 02              an exception has two bytes, whoever says three
//
// A reply of another transaction is a late one, and passed over whole. TCP loses and changes
// nothing, and no check value shows where a message begins: behind bytes that are no header nothing
// is believed before the connection has fallen silent.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/tcp_frame_rule.h"

#include <algorithm>

#include "protocols/common/frame_cuts.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/expect.h"
#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

constexpr std::size_t kHeader = kTcpOverhead - kTcpCounted;
constexpr std::size_t kTcpException = kTcpOverhead + 2;

/// A message of `size` bytes, as the header says or as is known better.
Cut CutMessage(View held, std::size_t size, bool idle) {
  return held.size() < size ? cut::Wait(idle, held.size()) : Cut::Frame(size);
}

Cut NoHeader(View held, const Expectation& expect, bool idle) {
  if (held.size() < kHeader) return cut::Wait(idle, held.size());
  if (!idle && held.size() < expect.max_bytes) return Cut::NeedMore();
  return Cut::Discard(std::min(held.size(), expect.max_bytes), Outcome::corrupt,
                      "not the header of a Modbus TCP message");
}

/// Some servers count too many bytes: 4 where an exception of two and the unit follow. Where
/// function and request fix the size, it is that, unless the reply itself bears its header out.
/// `told`: by the header.
std::size_t SizeOfReply(View held, const Expectation& expect, std::size_t told, bool idle) {
  if (held.size() <= kTcpOverhead) return told;
  const std::uint8_t function = held[kTcpOverhead];
  if (function >= kExceptionBit) return std::min(told, kTcpException);
  const int tag = TagOf(ByteReader(held).U16Be(0).value_or(0), function);
  const auto shape = std::ranges::find(expect.shapes, tag, &Shape::tag);
  if (shape == expect.shapes.end() || shape->min_length != shape->max_length) return told;
  const std::size_t size = std::min(told, shape->max_length);
  if (HasByteCount(function)) {
    const auto count = ByteReader(held).U8(kTcpOverhead + 1);
    return count && kTcpOverhead + 2 + *count == size ? size : told;
  }
  // The header may be right, and the reply odd: a write that is confirmed with the whole request.
  return idle ? size : told;
}

}  // namespace

Cut TcpRequestRule(View held, const Expectation& expect, bool idle) {
  const auto size = TcpSize(held);
  return size ? CutMessage(held, *size, idle) : NoHeader(held, expect, idle);
}

Cut TcpReplyRule(View held, const Expectation& expect, bool idle) {
  const auto told = TcpSize(held);
  if (!told) return NoHeader(held, expect, idle);
  const Cut message = CutMessage(held, SizeOfReply(held, expect, *told, idle), idle);
  if (message.kind != Cut::Kind::frame || expect.shapes.empty()) return message;
  const std::uint16_t transaction = ByteReader(held).U16Be(0).value_or(0);
  if (transaction != TransactionOf(expect.shapes.front().tag)) {
    return Cut::Discard(message.size, Outcome::unexpected, "the reply to another transaction");
  }
  if (!expect.address.empty() && held[kHeader] != expect.address[0]) {
    return cut::OfAnother(message.size);
  }
  return message;
}

}  // namespace baudgate::protocols::modbus
