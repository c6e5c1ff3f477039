// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/rules.h"

#include <algorithm>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "protocols/common/frame_cuts.h"
#include "protocols/modbus/plan.h"
#include "protocols/modbus/points.h"

namespace baudgate::protocols::modbus {
namespace {

constexpr std::size_t kExceptionPdu = 2;

void Allow(Expectation& expect, Framing framing, int tag, std::size_t least, std::size_t most) {
  expect.shapes.push_back({tag, FrameLength(framing, least), FrameLength(framing, most)});
}

Result<std::uint8_t> SlaveOf(std::string_view address) { return ParseAddress(address); }

template <Framing kFraming>
Bytes WrapPdu(std::uint8_t slave, View pdu) {
  return Wrap(kFraming, slave, pdu);
}

template <Framing kFraming>
Outcome UnwrapReply(View request, View frame, Bytes& pdu) {
  pdu.clear();
  const auto asked = Unwrap(kFraming, request);
  auto answer = Unwrap(kFraming, frame);
  if (!asked || !answer || asked->slave != answer->slave) return Outcome::unexpected;
  const Outcome outcome = CheckReply(asked->pdu, answer->pdu).outcome;
  if (outcome != Outcome::unexpected || answer->pdu[0] == asked->pdu[0]) {
    pdu = std::move(answer->pdu);
  }
  return outcome;
}

template <Framing kFraming>
std::optional<std::pair<std::uint8_t, Bytes>> UnwrapRequest(View frame) {
  auto adu = Unwrap(kFraming, frame);
  if (!adu || adu->slave > kLastSlave || adu->pdu[0] == 0 || adu->pdu[0] >= kExceptionBit) {
    return std::nullopt;
  }
  return std::pair(adu->slave, std::move(adu->pdu));
}

template <Framing kFraming>
constexpr PduCarrier kCarrier = {
    SlaveOf, WrapPdu<kFraming>, UnwrapReply<kFraming>, UnwrapRequest<kFraming>, IsCommon, kFraming};

}  // namespace

Expectation Expect(Framing framing, View request) {
  Expectation expect;
  expect.max_bytes = MaxFrame(framing);
  if (request.empty()) return expect;
  const auto adu = Unwrap(framing, request);
  if (!adu) return expect;
  const Bytes& pdu = adu->pdu;
  expect.address = {adu->slave};
  expect.repeatable = IsRepeatable(pdu);
  expect.mirrors = MayBeMirrored(pdu[0]);
  if (IsBroadcast(framing, adu->slave)) {
    expect.reply = Expectation::Reply::none;
    return expect;
  }
  Allow(expect, framing, TagOf(adu->transaction, pdu[0] | kExceptionBit), kExceptionPdu,
        kExceptionPdu);
  const int tag = TagOf(adu->transaction, pdu[0]);
  const auto awaited = AwaitedLength(pdu);
  if (!awaited) {
    Allow(expect, framing, tag, 1, kMaxPdu);
  } else if (*awaited <= kMaxPdu) {
    Allow(expect, framing, tag, *awaited, *awaited);
  }
  return expect;
}

const PduCarrier* Carrier(Framing framing) {
  if (framing == Framing::tcp) return nullptr;
  return framing == Framing::rtu ? &kCarrier<Framing::rtu> : &kCarrier<Framing::ascii>;
}

// Cuts RTU frames by their known length and CRC.
//
//   > 14 | 03 01 F4 00 01 | C6 C1                read holding 500 of slave 20
//   < 14 | 03 02 00 4B | F5 B0                   its value: 004B
//   > 14 | 06 00 08 00 02 | 8B 0C                write holding 8; the reply is the same
//   > 14 | 10 03 E7 00 78 F0 ... 240 bytes ... | CRC    write 120 registers, 249 bytes
//   < 14 | 83 02 | D1 35                         exception: illegal data address
//
// A listener also receives replies of other slaves and skips them. A skipped reply can contain
// bytes that look like a request:
//
//   < 4D | 03 08 01 06 04 D2 10 E1 E5 4B | BF 4D its data is a write to slave 1
//
// The silence of 3.5 characters between frames is lost in USB adapters and serial servers, so the
// rule waits for silence only after functions of unknown length.

namespace {

using Kind = PduLength::Kind;

constexpr std::size_t kShortest = kRtuOverhead + 1;
/// The length of a loopback PDU with one data word. The standard allows several words; hardly any
/// master sends them.
constexpr PduLength kUsualLoopback = {Kind::exact, 5};
/// If a reply of another slave has another function than the expected one, the rule waits for the
/// rest of the reply only if the reply has at most this many bytes.
constexpr std::size_t kShortReply = 32;

/// Cuts a frame that only silence ends: the CRC must be correct over all bytes received.
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
    reply,       ///< a reply of a slave
    open,        ///< incomplete: the bytes may become a request or a reply
    by_silence,  ///< the bytes may be a request whose end only silence shows
    neither,
  };
  Kind kind = Kind::neither;
  std::size_t size = 0;
};

enum class Fit : std::uint8_t { whole, open, none };

Fit FitOf(View held, PduLength length) {
  if (length.kind == Kind::need_more) return Fit::open;
  if (length.kind == Kind::unknown) return Fit::none;
  const std::size_t size = length.size + kRtuOverhead;
  if (held.size() < size) return Fit::open;
  return EndsInCrc16(held.first(size)) ? Fit::whole : Fit::none;
}

/// Classifies the bytes that a listener has received so far. Only the results `open` and
/// `by_silence` can change when more bytes come. A loopback is accepted as soon as it has two data
/// bytes, its usual length.
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

/// Returns the length of a frame with an unknown function: that of the whole burst if its CRC is
/// correct, else the shortest length with a correct CRC. 0: no length fits.
std::size_t EndOfUnknown(View burst) {
  if (EndsInCrc16(burst)) return burst.size();
  std::size_t size = kShortest;
  while (size < burst.size() && !EndsInCrc16(burst.first(size))) ++size;
  return size < burst.size() ? size : 0;
}

/// True if the burst consists of whole frames up to its end; the last may be incomplete unless
/// `idle`.
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

/// True for a byte that cannot begin a frame, or that often appears before frames (00, FF).
bool IsNoise(std::uint8_t byte) { return cut::IsHarmless(byte) || byte > kLastSlave; }

/// Drops a burst that is longer than any frame. The last byte that cannot begin a frame becomes the
/// first byte of the rest, so that no byte in the middle of the burst is taken for the beginning of
/// a frame.
Cut DropFlood(View burst) {
  const auto no_frame = [&](std::size_t at) {
    return !IsNoise(burst[at]) && LookAt(burst.subspan(at), false).kind == Head::Kind::neither;
  };
  std::size_t size = burst.size() - 1;
  while (size > 0 && !no_frame(size)) --size;
  return cut::TooLong(size > 0 ? size : burst.size());
}

/// Handles bytes that may be a reply to another request: another slave sends it, or it is late. The
/// rule waits for the whole reply if its length is known or its function is the expected one. If
/// another slave sends a reply with another function, the rule waits only if it is at most
/// kShortReply bytes long.
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

/// Cuts a reply that repeats the whole request: some devices confirm functions 15 and 16 in this
/// way. The bytes can also be an echo of the request, followed by the reply, so the rule waits for
/// silence.
Cut WholeWrite(View held, bool idle) {
  const PduLength length = RequestLength(held.subspan(1));
  const std::size_t size = length.size + kRtuOverhead;
  if (length.kind != Kind::exact || held.size() > size) return cut::BadChecksum();
  if (!idle) return Cut::NeedMore();
  return held.size() == size && EndsInCrc16(held) ? Cut::Frame(size) : cut::BadChecksum();
}

}  // namespace

// Cuts requests for a listener. A byte count is used only if it agrees with the quantity before it.
// The reply to a write of one register equals its request, and a reply with 17 to 24 bits is as
// long as a request with the same CRC. A listener takes these replies for requests to another
// slave.
//
// A frame begins only after silence or directly after another good frame. A search inside damaged
// bytes could find a request in the data of other frames and execute it. So bytes that are neither
// request nor reply are kept until the line is silent, because the rest may still come, and are
// then dropped with all bytes after them. A request among these bytes is lost, and its master
// repeats it.
Cut RtuRequestRule(View held, const Expectation&, bool idle) {
  const Head head = LookAt(held, idle);
  if (head.kind == Head::Kind::request) return Cut::Frame(head.size);
  if (head.kind == Head::Kind::reply) {
    return Cut::Discard(head.size, Outcome::none, "another device's reply");
  }
  const bool over = idle || held.size() > kMaxRtu;
  if (!over && head.kind != Head::Kind::neither) return Cut::NeedMore();
  if (head.kind == Head::Kind::by_silence) {
    // One in some thousand lengths has a correct CRC by chance, so the bytes behind the frame must
    // be frames, too.
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

// Cuts replies. The request defines the slave, the function and the length of the reply, or an
// exception. After damaged bytes the rule moves on by one byte. A whole reply of another slave is
// skipped. A reply of this slave to another request is cut as a frame, and the conversation judges
// it.
Cut RtuReplyRule(View held, const Expectation& expect, bool idle) {
  if (expect.shapes.empty()) return BySilence(held, expect.max_bytes, idle);
  if (!expect.address.empty() && held[0] != expect.address[0]) {
    return AnotherReply(held, expect, true, "the reply is not from the device that was asked",
                        idle);
  }
  if (held.size() < 2) return cut::Wait(idle);
  const auto shape =
      std::ranges::find_if(expect.shapes, [&](const Shape& s) { return s.tag == held[1]; });
  if (shape == expect.shapes.end()) {
    return AnotherReply(held, expect, false, "the bytes are not a reply to the request", idle);
  }
  std::size_t size = shape->max_length;
  if (shape->min_length != shape->max_length) {
    const PduLength length = ReplyLength(held.subspan(1));
    if (length.kind == Kind::need_more) return cut::Wait(idle);
    if (length.kind == Kind::unknown) return BySilence(held, shape->max_length, idle);
    size = length.size + kRtuOverhead;
  } else if (HasByteCount(held[1]) && held.size() > 2 && held[2] != size - kRtuOverhead - 2) {
    return AnotherReply(held, expect, false, "the reply has another byte count than requested",
                        idle);
  }
  if (held.size() < size) return cut::Wait(idle);
  if (EndsInCrc16(held.first(size))) return Cut::Frame(size);
  return IsMultipleWrite(held[1]) ? WholeWrite(held, idle) : cut::BadChecksum();
}

// The rules for Modbus ASCII cut lines from ':' to CR LF with a correct LRC.
//
//   > 3A 31 34 30 33 30 31 46 34 30 30 30 31 46 33 0D 0A   :140301F40001F3 CR LF
//                                                          read holding 500 of slave 20
//   < 3A 31 34 30 33 30 32 30 30 33 31 42 36 0D 0A         :1403020031B6 CR LF       0031
//   < 3A 31 34 38 33 30 32 36 37 0D 0A                     :14830267 CR LF           exception 02
//
// Hex digits can be in either case. If the line feed is missing, the next character or silence
// shows this. A second ':' means that the first line was cut off.

namespace {

Cut CutLine(View held, const Expectation& expect, bool idle) {
  if (held.front() != ':') return cut::SkipNoise(held, ":", "\r\n");
  const auto stop = std::find_if_not(held.begin() + 1, held.end(), [](std::uint8_t byte) {
    return HexDigit(static_cast<char>(byte)).has_value();
  });
  const auto end = static_cast<std::size_t>(stop - held.begin());
  const bool line_feed_missing = end + 1 == held.size();
  if (end + 2 > expect.max_bytes) {
    return cut::TooLong();
  }
  if (stop == held.end()) {
    return cut::Wait(idle, end);
  }
  if (*stop == ':') return Cut::Discard(end, Outcome::partial, "another frame begins");
  if (*stop != '\r') return Cut::Discard(end + 1, Outcome::corrupt, "not a hex digit");
  if (line_feed_missing && !idle) return Cut::NeedMore();
  const std::size_t size = !line_feed_missing && held[end + 1] == '\n' ? end + 2 : end + 1;
  if (!Unwrap(Framing::ascii, held.first(size))) {
    return cut::BadChecksum(size);
  }
  return Cut::Frame(size);
}

}  // namespace

Cut AsciiRequestRule(View held, const Expectation& expect, bool idle) {
  return CutLine(held, expect, idle);
}

Cut AsciiReplyRule(View held, const Expectation& expect, bool idle) {
  const Cut line = CutLine(held, expect, idle);
  if (line.kind != Cut::Kind::frame || expect.shapes.empty()) return line;
  const auto adu = Unwrap(Framing::ascii, held.first(line.size));
  if (!expect.address.empty() && adu->slave != expect.address[0]) {
    return cut::OfAnother(line.size);
  }
  const std::size_t length = FrameLength(Framing::ascii, adu->pdu.size());
  const auto shape = std::ranges::find(expect.shapes, adu->pdu[0], &Shape::tag);
  const bool asked = shape != expect.shapes.end();
  const bool fits = asked && length >= shape->min_length && length <= shape->max_length;
  if (fits || IsReplyForm(adu->pdu)) return line;
  // Some devices confirm functions 15 and 16 with the whole request (see WholeWrite). An echo of
  // the request has the same bytes, but the reply follows it, so the rule waits for silence.
  const bool whole_write = asked && IsMultipleWrite(adu->pdu[0]) && IsCommon(adu->pdu);
  if (whole_write && held.size() == line.size) return idle ? line : Cut::NeedMore();
  return Cut::Discard(line.size, Outcome::partial, "the bytes are not a reply to the request");
}

// The rules for Modbus TCP cut messages by the length in their header.
//
//   > 00 01 00 00 00 06 14 | 03 01 F4 00 01     transaction 1, unit 20: read holding 500
//   < 00 01 00 00 00 05 14 | 03 02 00 31        its value: 0031
//   < 00 01 00 00 00 03 14 | 83 02              or an exception: illegal data address
//
// If function and request define the size of a reply and its header counts more bytes, the header
// is wrong, and the next message begins after the defined size:
//
//   < 00 01 00 00 00 04 14 | 83 02              an exception has two bytes, not three
//
// A reply with the number of another transaction is late and skipped. TCP loses and changes no
// bytes, and no check value shows where a message begins. So after bytes that are not a header, all
// bytes are dropped until the connection is silent.

namespace {

constexpr std::size_t kHeader = kTcpOverhead - kTcpCounted;
constexpr std::size_t kTcpException = kTcpOverhead + 2;

Cut CutMessage(View held, std::size_t size, bool idle) {
  return held.size() < size ? cut::Wait(idle, held.size()) : Cut::Frame(size);
}

Cut NoHeader(View held, const Expectation& expect, bool idle) {
  if (held.size() < kHeader) return cut::Wait(idle, held.size());
  if (!idle && held.size() < expect.max_bytes) return Cut::NeedMore();
  return Cut::Discard(std::min(held.size(), expect.max_bytes), Outcome::corrupt,
                      "the bytes are not the header of a Modbus TCP message");
}

/// Returns the size of the reply at the front of `held`. `told`: the size according to its header.
/// Some servers count too many bytes: 4 for the unit and an exception of two bytes. If function and
/// request define the size, that size is used, unless the byte count in the reply contradicts it.
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
  // The header may be correct and the reply unusual: some devices confirm a write with the whole
  // request. So the rule uses the size that the request defines only after silence.
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
    return Cut::Discard(message.size, Outcome::unexpected, "the reply is to another transaction");
  }
  if (!expect.address.empty() && held[kHeader] != expect.address[0]) {
    return cut::OfAnother(message.size);
  }
  return message;
}

namespace {

constexpr config::SerialSettings Format(int baud, int data_bits, config::Parity parity) {
  return {.baud = baud, .data_bits = data_bits, .parity = parity};
}
constexpr auto kNone = config::Parity::none;
constexpr auto kEven = config::Parity::even;
constexpr auto kOdd = config::Parity::odd;

constexpr config::SerialSettings kRtuSerials[] = {
    Format(9600, 8, kNone),  Format(19200, 8, kEven),       Format(9600, 8, kEven),
    Format(19200, 8, kNone), Format(115200, 8, kNone),      Format(38400, 8, kNone),
    Format(57600, 8, kNone), Format(38400, 8, kEven),       Format(115200, 8, kEven),
    Format(9600, 8, kOdd),   Format(19200, 8, kOdd),        Format(4800, 8, kNone),
    Format(2400, 8, kNone),  {.baud = 9600, .stop_bits = 2}};
constexpr config::SerialSettings kAsciiSerials[] = {Format(9600, 7, kEven), Format(19200, 7, kEven),
                                                    Format(9600, 8, kNone), Format(19200, 8, kNone),
                                                    Format(9600, 7, kOdd)};

constexpr ScanMode kModes[] = {{}};

enum Question : std::size_t { kServer, kObjects, kLoopback, kHolding, kInput, kCount };
/// The data of the loopback in a scan: a pattern that no other reply is likely to contain.
constexpr std::uint16_t kScanLoopback = 0xA537;

Bytes PduOf(std::size_t question) {
  switch (question) {
    case kServer:
      return {modbus::kServerId};
    case kObjects:
      return {kEncapsulated, kIdentification, kBasic, 0};
    case kLoopback:
      return LoopbackRequest(kScanLoopback);
    case kHolding:
      return ReadRequest(kReadHolding, 0, 1);
    default:
      return ReadRequest(kReadInput, 0, 1);
  }
}

template <Framing kFraming>
Bytes AskSlave(unsigned address, std::size_t, std::size_t question) {
  return Wrap(kFraming, static_cast<std::uint8_t>(address), PduOf(question));
}

void Tell(Sighting& sighting, const std::string& name) {
  if (!config::SpokenName(name).empty()) sighting.names.push_back(name);
}

/// Takes the names and an example of a point for the scan from a good reply.
void TakeReply(View pdu, const Data& data, Sighting& sighting) {
  switch (pdu[0]) {
    case modbus::kServerId:
      if (data.texts.contains(0)) Tell(sighting, data.texts.at(0));
      break;
    case kEncapsulated: {
      const auto product = data.texts.find(kProduct);
      const auto vendor = data.texts.find(kVendor);
      if (product == data.texts.end()) break;
      if (vendor != data.texts.end()) Tell(sighting, vendor->second + " " + product->second);
      Tell(sighting, product->second);
      break;
    }
    case kReadHolding:
      sighting.point = "{ name: holding_0, read: holding 0, type: uint16, group: fast, modbus: 0 }";
      break;
    case kReadInput:
      sighting.point = "{ name: input_0, read: input 0, type: uint16, group: fast, modbus: 0 }";
      break;
    default:
      break;
  }
  if (!sighting.names.empty()) sighting.identity = Trim(sighting.names.front());
}

template <Framing kFraming>
Sighting JudgeSlave(View request, View frame, std::size_t) {
  Sighting sighting;
  const auto asked = Unwrap(kFraming, request);
  const auto reply = Unwrap(kFraming, frame);
  if (!asked || !reply || asked->slave != reply->slave) return sighting;
  const Verdict verdict = CheckReply(asked->pdu, reply->pdu);
  if (verdict.outcome == Outcome::unexpected) return sighting;
  const bool mirrored = asked->pdu == reply->pdu;
  sighting.what = mirrored ? Sighting::What::maybe : Sighting::What::device;
  if (verdict.outcome != Outcome::ok || mirrored) return sighting;
  if (const auto data = DataOf(asked->pdu, reply->pdu)) TakeReply(asked->pdu, *data, sighting);
  return sighting;
}

template <Framing kFraming>
ScanRule RuleOf(std::span<const config::SerialSettings> serials) {
  return {.serials = serials,
          .first_address = 1,
          .last_address = kLastSlave,
          .modes = kModes,
          .questions = kCount,
          // A read of holding registers is sent only to addresses that have answered as a Modbus
          // slave: SET-4TM meters use the same CRC, and take 03 00 for a write.
          .finds = 1U << kServer | 1U << kObjects | 1U << kLoopback | 1U << kInput,
          .quick_finds = 1U << kServer | 1U << kInput,
          .never_at = kFraming == Framing::rtu ? "set4tm" : "",
          .usual = 80ms,
          .ask = AskSlave<kFraming>,
          .judge = JudgeSlave<kFraming>};
}

}  // namespace

const ScanRule* ScanOf(Framing framing) {
  static const ScanRule kRtu = RuleOf<Framing::rtu>(kRtuSerials);
  static const ScanRule kAscii = RuleOf<Framing::ascii>(kAsciiSerials);
  if (framing == Framing::tcp) return nullptr;
  return framing == Framing::rtu ? &kRtu : &kAscii;
}

namespace {

constexpr std::string_view kLrcPlace = "XX";

/// Completes typed bytes: adds the CRC to `01 03 00 00 00 01`, unless the bytes end with a correct
/// CRC.
Result<Bytes> CompleteRtu(View written, const ParsedOptions&) {
  if (written.size() < 2) {
    return Error{"a Modbus telegram is slave, function and data in hex, as in '01 03 00 00 00 01'"};
  }
  Bytes frame(written.begin(), written.end());
  if (!Unwrap(Framing::rtu, written)) AppendCrc16(frame);
  if (frame.size() > kMaxRtu) return Error{"a Modbus RTU frame has at most 256 bytes"};
  return frame;
}

/// Completes typed text to a whole frame: `:010300000001`, or `:010300000001XX` with XX in place of
/// the LRC.
Result<Bytes> CompleteAscii(View written, const ParsedOptions&) {
  std::string_view text = Trim(AsText(written));
  const Error wrong{"a Modbus ASCII telegram is ':' and hex, as in ':010300000001XX'"};
  if (!text.starts_with(':')) return wrong;
  text.remove_prefix(1);
  const bool asked_for = text.ends_with(kLrcPlace);
  if (asked_for) text.remove_suffix(kLrcPlace.size());
  const auto bytes = ParseHex(text);
  if (!bytes || bytes->size() < 2 || bytes->size() > kMaxPdu + 2) return wrong;
  if (!asked_for && bytes->size() > 2 && Sum8(*bytes) == 0) {
    return Wrap(Framing::ascii, (*bytes)[0], View(*bytes).subspan(1, bytes->size() - 2));
  }
  return Wrap(Framing::ascii, (*bytes)[0], View(*bytes).subspan(1));
}

bool IsReadPdu(View pdu) {
  if (modbus::IsRead(pdu[0])) return IsCommon(pdu);
  if (pdu[0] == modbus::kServerId) return pdu.size() == 1;
  if (pdu[0] == kDiagnostics) return pdu.size() == 5 && pdu[1] == 0 && pdu[2] == 0;
  return pdu[0] == kEncapsulated && pdu.size() == 4 && pdu[1] == kIdentification;
}

template <Framing kFraming>
bool IsReadFrame(View request, const ParsedOptions&) {
  const auto adu = Unwrap(kFraming, request);
  return adu && adu->slave != 0 && IsReadPdu(adu->pdu);
}

constexpr TelegramRule kRtu = {"", CompleteRtu, IsReadFrame<Framing::rtu>};
constexpr TelegramRule kAscii = {":", CompleteAscii, IsReadFrame<Framing::ascii>};

}  // namespace

const TelegramRule* TelegramOf(Framing framing) {
  if (framing == Framing::tcp) return nullptr;
  return framing == Framing::rtu ? &kRtu : &kAscii;
}

}  // namespace baudgate::protocols::modbus
