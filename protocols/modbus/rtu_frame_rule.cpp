// Cuts RTU frames by their known length and CRC; the silence of 3.5 characters that ends them on
// the wire does not survive USB adapters and serial servers, so only functions of unknown length
// wait for it.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/rtu_frame_rule.h"

#include <algorithm>

#include "protocols/modbus/codec.h"
#include "protocols/modbus/pdu.h"

namespace baudgate::modbus_master {
namespace {

using Kind = PduLength::Kind;

constexpr std::size_t kShortest = kRtuOverhead + 1;
/// Of other slaves' replies to other functions only those up to this length are waited for.
constexpr std::size_t kShortReply = 32;

/// Bytes that appear when a driver is switched on or off.
bool IsHarmless(std::uint8_t byte) { return byte == 0x00 || byte == 0xFF; }

Cut Slide(View held, std::string_view why) {
  return Cut::Discard(1, IsHarmless(held[0]) ? Outcome::none : Outcome::partial, why);
}

/// Not whole yet: more may come, unless the line is silent.
Cut Wait(bool idle) {
  return idle ? Cut::Discard(1, Outcome::partial, "stopped mid-frame") : Cut::NeedMore();
}

/// Only silence ends it, and then the CRC must be right over all that came.
Cut BySilence(View held, std::size_t most, bool idle) {
  if (held.size() > most) return Cut::Discard(1, Outcome::corrupt, "longer than any frame");
  if (!idle) return Cut::NeedMore();
  if (held.size() < kShortest) return Wait(idle);
  if (CrcGood(held)) return Cut::Frame(held.size());
  return Cut::Discard(1, Outcome::corrupt, "checksum");
}

/// The length of a whole reply with a good CRC at the head, or 0: on a bus with several devices a
/// listener hears their replies, too.
std::size_t OthersReply(View held) {
  if (held.size() < kShortest) return 0;
  const PduLength length = ReplyLength(held.subspan(1));
  if (length.kind != Kind::exact) return 0;
  const std::size_t size = length.size + kRtuOverhead;
  return size <= held.size() && CrcGood(held.first(size)) ? size : 0;
}

Cut NoRequest(View held, Outcome blame, std::string_view why) {
  const std::size_t others = OthersReply(held);
  if (others > 0) return Cut::Discard(others, Outcome::none, "another device's reply");
  return Cut::Discard(1, IsHarmless(held[0]) ? Outcome::none : blame, why);
}

/// An exception that another device answers is passed over whole.
Cut PassException(View held, bool idle) {
  if (held.size() < 5 && !idle) return Cut::NeedMore();
  return NoRequest(held, Outcome::partial, "not a request");
}

/// Requests that only silence ends: they may be cut by mistake no sooner than that. A loopback has
/// two bytes of data nearly always.
Cut CutUnknown(View held, bool idle) {
  constexpr std::size_t kUsualLoopback = 8;
  if (held[1] == kDiagnostics && held.size() >= kUsualLoopback &&
      CrcGood(held.first(kUsualLoopback))) {
    return Cut::Frame(kUsualLoopback);
  }
  const std::size_t others = OthersReply(held);
  if (others > 0 && (others < held.size() || idle)) {
    return Cut::Discard(others, Outcome::none, "another device's reply");
  }
  const Cut cut = BySilence(held, kMaxRtu, idle);
  return cut.kind == Cut::Kind::discard ? NoRequest(held, cut.blame, cut.why) : cut;
}

/// What may be a whole reply of another slave: with a good CRC it is passed over whole, and the
/// awaited one may stand behind it. Only functions whose replies have a known length, or the
/// awaited ones, are waited for.
Cut FromAnother(View held, const Expectation& expect, bool idle, std::string_view why) {
  if (held[0] == 0 || held[0] > kLastSlave) return Slide(held, why);
  const auto wait = [&] { return idle ? Slide(held, why) : Cut::NeedMore(); };
  if (held.size() < 2) return wait();
  const bool exception = held[1] >= kExceptionBit;
  if ((exception ? held[1] - kExceptionBit : held[1]) > kEncapsulated) return Slide(held, why);
  PduLength length = ReplyLength(held.subspan(1));
  if (length.kind == Kind::need_more) return wait();
  if (length.kind == Kind::unknown) {
    const auto shape =
        std::ranges::find_if(expect.shapes, [&](const Shape& s) { return s.tag == held[1]; });
    if (shape == expect.shapes.end()) return Slide(held, why);
    length.size = shape->min_length - kRtuOverhead;
  }
  const std::size_t size = length.size + kRtuOverhead;
  const bool awaited =
      std::ranges::any_of(expect.shapes, [&](const Shape& s) { return s.tag == held[1]; });
  if (!awaited && size > kShortReply) return Slide(held, why);
  if (held.size() < size) return wait();
  return CrcGood(held.first(size)) ? Cut::Discard(size, Outcome::unexpected, why)
                                   : Slide(held, why);
}

}  // namespace

// Request:  14 | 03 01 F4 00 01 | C6 C1                read holding 500 of slave 20
//           14 | 06 00 08 00 02 | 8B 0C                write holding 8
//           14 | 10 03 E7 00 78 F0 … 240 bytes … | CRC write 120 registers, 249 bytes
// Heard on the bus between two requests, and passed over:
//           14 | 03 02 09 C4 | B2 44                   the reply of a slave
//           14 | 83 02 | D1 35                         its exception
// A byte count is believed only when it agrees with the quantity before it. The reply to a write of
// one register equals its request, and one that holds 17 to 24 bits is as long as a request and has
// its CRC: a listener takes them for requests to a slave that it is not.
Cut RtuRequestRule(View held, const Expectation&, bool idle) {
  if (held[0] > kLastSlave) return Slide(held, "no slave has this address");
  if (held.size() < 2) return Wait(idle);
  if (held[1] == 0) return Slide(held, "not a request");
  if (held[1] >= kExceptionBit) return PassException(held, idle);
  const PduLength length = RequestLength(held.subspan(1));
  if (length.kind == Kind::unknown) return CutUnknown(held, idle);
  const std::size_t size = length.size + kRtuOverhead;
  if (length.kind == Kind::need_more || held.size() < size) {
    return idle ? NoRequest(held, Outcome::partial, "stopped mid-frame") : Cut::NeedMore();
  }
  if (CrcGood(held.first(size))) return Cut::Frame(size);
  return NoRequest(held, Outcome::corrupt, "checksum");
}

// Reply:    14 | 03 02 09 C4 | B2 44                   25.00 Hz
//           14 | 03 02 00 CA | 35 D0                   2.02 A
//           14 | 03 02 00 4B | F5 B0                   status word 004B
//           14 | 06 00 08 00 02 | 8B 0C                the write is repeated
//           14 | 83 02 | D1 35                         exception: illegal data address
// The request says who answers, with which function, and how long the answer is: a good one or an
// exception. After damage the rule slides by one. A whole reply of another slave is a frame as
// well.
Cut RtuReplyRule(View held, const Expectation& expect, bool idle) {
  if (expect.shapes.empty()) return BySilence(held, expect.max_bytes, idle);
  if (!expect.address.empty() && held[0] != expect.address[0]) {
    return FromAnother(held, expect, idle, "not from the device that was asked");
  }
  if (held.size() < 2) return Wait(idle);
  const auto shape =
      std::ranges::find_if(expect.shapes, [&](const Shape& s) { return s.tag == held[1]; });
  if (shape == expect.shapes.end()) {
    return Slide(held, "not a reply to what was asked");
  }
  std::size_t size = shape->max_length;
  if (shape->min_length != shape->max_length) {
    const PduLength length = ReplyLength(held.subspan(1));
    if (length.kind == Kind::need_more) return Wait(idle);
    if (length.kind == Kind::unknown) return BySilence(held, shape->max_length, idle);
    size = length.size + kRtuOverhead;
  } else if (HasByteCount(held[1]) && held.size() > 2 && held[2] != size - kRtuOverhead - 2) {
    return Slide(held, "another byte count than was asked for");
  }
  if (held.size() < size) return Wait(idle);
  if (CrcGood(held.first(size))) return Cut::Frame(size);
  return Cut::Discard(1, Outcome::corrupt, "checksum");
}

}  // namespace baudgate::modbus_master
