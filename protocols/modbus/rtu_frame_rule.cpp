// Cuts RTU frames by their known length and CRC.
//
//   > 14 | 03 01 F4 00 01 | C6 C1                read holding 500 of slave 20
//   < 14 | 03 02 00 4B | F5 B0                   its value: 004B
//   > 14 | 06 00 08 00 02 | 8B 0C                write holding 8; the reply is the same
//   > 14 | 10 03 E7 00 78 F0 ... 240 bytes ... | CRC    write 120 registers, 249 bytes
//   < 14 | 83 02 | D1 35                         exception: illegal data address
//
// A listener also hears the replies of other slaves, and passes them over. One may hold a request:
//
//   < 4D | 03 08 01 06 04 D2 10 E1 E5 4B | BF 4D data that are a write to slave 1
//
// The silence of 3.5 characters that ends frames on the wire does not survive USB adapters and
// serial servers, so only functions of unknown length wait for it.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/rtu_frame_rule.h"

#include <algorithm>

#include "gateway/base/checksum.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/modbus/codec.h"
#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

using Kind = PduLength::Kind;

constexpr std::size_t kShortest = kRtuOverhead + 1;
/// A loopback has one or more words of data; nearly all have one.
constexpr PduLength kUsualLoopback = {Kind::exact, 5};
/// Replies of other slaves to other functions are waited for up to this length only.
constexpr std::size_t kShortReply = 32;

/// Only silence ends it, and then the CRC must be right over all that came.
Cut BySilence(View held, std::size_t most, bool idle) {
  if (held.size() > most) return cut::TooLong();
  if (!idle) return Cut::NeedMore();
  if (held.size() < kShortest) return cut::Wait(idle);
  if (EndsInCrc16(held)) return Cut::Frame(held.size());
  return cut::BadChecksum();
}

struct Head {
  enum class Kind : std::uint8_t {
    request,
    reply,       ///< of another slave
    open,        ///< may become either
    by_silence,  ///< may be a request that only silence ends
    neither,
  };
  Kind kind = Kind::neither;
  std::size_t size = 0;  ///< of request and reply
};

enum class Fit : std::uint8_t { whole, open, none };

Fit FitOf(View held, PduLength length) {
  if (length.kind == Kind::need_more) return Fit::open;
  if (length.kind == Kind::unknown) return Fit::none;
  const std::size_t size = length.size + kRtuOverhead;
  if (held.size() < size) return Fit::open;
  return EndsInCrc16(held.first(size)) ? Fit::whole : Fit::none;
}

/// What a listener hears. More bytes change nothing but `open` and `by_silence`. A loopback is
/// taken as soon as it is one of two bytes of data, as nearly all are.
Head LookAt(View held, bool idle) {
  if (held[0] > kLastSlave) return {};
  if (held.size() < 2) return {Head::Kind::open};
  const View pdu = held.subspan(1);
  if (pdu[0] == 0) return {};
  const bool exception = pdu[0] >= kExceptionBit;
  PduLength request = exception ? PduLength() : RequestLength(pdu);
  const bool endless = !exception && request.kind == Kind::unknown;
  if (endless && pdu[0] == kDiagnostics) request = kUsualLoopback;
  const Fit asked = FitOf(held, request);
  if (asked == Fit::whole) return {Head::Kind::request, request.size + kRtuOverhead};
  if (asked == Fit::open && !idle) return {Head::Kind::open};
  const PduLength reply = held[0] == 0 ? PduLength() : ReplyLength(pdu);
  const Fit answered = FitOf(held, reply);
  if (answered == Fit::whole) return {Head::Kind::reply, reply.size + kRtuOverhead};
  if (endless) return {Head::Kind::by_silence};
  const bool open = asked == Fit::open || answered == Fit::open;
  return {open ? Head::Kind::open : Head::Kind::neither};
}

/// The length of a frame whose function is not known: all of the burst, else the first length with
/// a good CRC; 0: there is none.
std::size_t EndOfUnknown(View burst) {
  if (EndsInCrc16(burst)) return burst.size();
  std::size_t size = kShortest;
  while (size < burst.size() && !EndsInCrc16(burst.first(size))) ++size;
  return size < burst.size() ? size : 0;
}

/// Whether frame follows frame to the end of the burst.
bool IsAllFrames(View burst, bool idle) {
  while (!burst.empty()) {
    const Head head = LookAt(burst, idle);
    if (head.kind == Head::Kind::open && !idle) return true;
    std::size_t size = head.size;
    if (head.kind == Head::Kind::by_silence) size = EndOfUnknown(burst);
    if (size == 0 && cut::IsHarmless(burst[0])) size = 1;
    if (size == 0) return false;
    burst = burst.subspan(size);
  }
  return true;
}

/// Can not begin a frame, or appears before one.
bool IsNoise(std::uint8_t byte) { return cut::IsHarmless(byte) || byte > kLastSlave; }

/// A burst that does not come to its end is dropped up to something in it that is no frame either:
/// so nothing in its midst is taken for a beginning.
Cut DropFlood(View burst) {
  const auto no_frame = [&](std::size_t at) {
    return !IsNoise(burst[at]) && LookAt(burst.subspan(at), false).kind == Head::Kind::neither;
  };
  std::size_t size = burst.size() - 1;
  while (size > 0 && !no_frame(size)) --size;
  return cut::TooLong(size > 0 ? size : burst.size());
}

/// What may be a whole reply, but to another request: of another slave, or one that comes late. It
/// is waited for if its length is known, or its function is the awaited one; of another slave also
/// only if it is short.
Cut AnotherReply(View held, const Expectation& expect, bool another_slave, std::string_view why,
                 bool idle) {
  if (held[0] == 0 || held[0] > kLastSlave) return cut::Slide(held, why);
  const auto wait = [&] { return idle ? cut::Slide(held, why) : Cut::NeedMore(); };
  if (held.size() < 2) return wait();
  const bool exception = held[1] >= kExceptionBit;
  if ((exception ? held[1] - kExceptionBit : held[1]) > kEncapsulated) {
    return cut::Slide(held, why);
  }
  const auto awaited =
      std::ranges::find_if(expect.shapes, [&](const Shape& s) { return s.tag == held[1]; });
  PduLength length = held[1] == kDiagnostics ? kUsualLoopback : ReplyLength(held.subspan(1));
  if (length.kind == Kind::need_more) return wait();
  if (length.kind == Kind::unknown) {
    if (awaited == expect.shapes.end()) return cut::Slide(held, why);
    length.size = awaited->min_length - kRtuOverhead;
  }
  const std::size_t size = length.size + kRtuOverhead;
  const bool too_long = another_slave && awaited == expect.shapes.end() && size > kShortReply;
  if (too_long || size > expect.max_bytes) return cut::Slide(held, why);
  if (held.size() < size) return wait();
  if (!EndsInCrc16(held.first(size))) return cut::Slide(held, why);
  if (another_slave) return cut::OfAnother(size);
  const View pdu = held.subspan(1, size - kRtuOverhead);
  return IsReplyForm(pdu) ? Cut::Frame(size) : cut::Slide(held, why);
}

/// Some devices confirm functions 15 and 16 with the whole request. It may as well be the request,
/// as the bus echoes it, and then the reply follows it: only silence tells.
Cut WholeWrite(View held, bool idle) {
  const PduLength length = RequestLength(held.subspan(1));
  const std::size_t size = length.size + kRtuOverhead;
  if (length.kind != Kind::exact || held.size() > size) return cut::BadChecksum();
  if (!idle) return Cut::NeedMore();
  return held.size() == size && EndsInCrc16(held) ? Cut::Frame(size) : cut::BadChecksum();
}

}  // namespace

// A byte count is believed only when it agrees with the quantity before it. The reply to a write of
// one register equals its request, and one that holds 17 to 24 bits is as long as a request and has
// its CRC: a listener takes them for requests to a slave that it is not.
//
// A frame begins after silence or behind another good frame, and nowhere else: to look for one
// within damage would be to execute the data of others. So what is neither a request nor a reply is
// kept until the line falls silent, for its rest may still be coming, and then dropped with all
// that came after it. A request among that is lost, and its master asks again.
Cut RtuRequestRule(View held, const Expectation&, bool idle) {
  const Head head = LookAt(held, idle);
  if (head.kind == Head::Kind::request) return Cut::Frame(head.size);
  if (head.kind == Head::Kind::reply) {
    return Cut::Discard(head.size, Outcome::none, "another device's reply");
  }
  const bool over = idle || held.size() > kMaxRtu;
  if (!over && head.kind != Head::Kind::neither) return Cut::NeedMore();
  if (head.kind == Head::Kind::by_silence) {
    // One length in thousands has a good CRC by chance: the rest of the burst has to bear it out.
    const View burst = held.first(std::min(held.size(), kMaxRtu));
    const std::size_t size = EndOfUnknown(burst);
    if (size > 0 && IsAllFrames(burst.subspan(size), idle)) return Cut::Frame(size);
  }
  if (IsNoise(held[0])) return cut::Slide(held, "noise before a frame");
  if (!over) return Cut::NeedMore();
  if (!idle) return DropFlood(held.first(kMaxRtu));
  const bool open = head.kind == Head::Kind::open;
  return open ? cut::Wait(idle, held.size()) : cut::BadChecksum(held.size());
}

// The request says who answers, with which function, and how long the answer is: a good one or an
// exception. After damage the rule slides by one. A whole reply of another slave is passed over
// whole; one of this slave to another request is a frame, for the conversation to tell.
Cut RtuReplyRule(View held, const Expectation& expect, bool idle) {
  if (expect.shapes.empty()) return BySilence(held, expect.max_bytes, idle);
  if (!expect.address.empty() && held[0] != expect.address[0]) {
    return AnotherReply(held, expect, true, "not from the device that was asked", idle);
  }
  if (held.size() < 2) return cut::Wait(idle);
  const auto shape =
      std::ranges::find_if(expect.shapes, [&](const Shape& s) { return s.tag == held[1]; });
  if (shape == expect.shapes.end()) {
    return AnotherReply(held, expect, false, "not a reply to what was asked", idle);
  }
  std::size_t size = shape->max_length;
  if (shape->min_length != shape->max_length) {
    const PduLength length = ReplyLength(held.subspan(1));
    if (length.kind == Kind::need_more) return cut::Wait(idle);
    if (length.kind == Kind::unknown) return BySilence(held, shape->max_length, idle);
    size = length.size + kRtuOverhead;
  } else if (HasByteCount(held[1]) && held.size() > 2 && held[2] != size - kRtuOverhead - 2) {
    return AnotherReply(held, expect, false, "another byte count than was asked for", idle);
  }
  if (held.size() < size) return cut::Wait(idle);
  if (EndsInCrc16(held.first(size))) return Cut::Frame(size);
  return IsMultipleWrite(held[1]) ? WholeWrite(held, idle) : cut::BadChecksum();
}

}  // namespace baudgate::protocols::modbus
