// Cuts Modbus TCP messages by the length in their header.
//
//   > 00 01 00 00 00 06 14 | 03 01 F4 00 01     transaction 1, unit 20: read holding 500
//   < 00 01 00 00 00 05 14 | 03 02 00 31        its value: 0031
//   < 00 01 00 00 00 03 14 | 83 02              exception in its place: illegal data address
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

namespace baudgate::protocols::modbus {
namespace {

constexpr std::size_t kHeader = kTcpOverhead - kTcpCounted;

/// The first whole message.
Cut CutMessage(View held, const Expectation& expect, bool idle) {
  if (held.size() < kHeader) return cut::Wait(idle, held.size());
  const auto size = TcpSize(held);
  if (size) return held.size() < *size ? cut::Wait(idle, held.size()) : Cut::Frame(*size);
  if (!idle && held.size() < expect.max_bytes) return Cut::NeedMore();
  return Cut::Discard(std::min(held.size(), expect.max_bytes), Outcome::corrupt,
                      "not the header of a Modbus TCP message");
}

}  // namespace

Cut TcpRequestRule(View held, const Expectation& expect, bool idle) {
  return CutMessage(held, expect, idle);
}

Cut TcpReplyRule(View held, const Expectation& expect, bool idle) {
  const Cut message = CutMessage(held, expect, idle);
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
