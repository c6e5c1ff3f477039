// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/rules.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "protocols/common/frame_cuts.h"
#include "protocols/common/settings.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/status.h"

namespace baudgate::protocols::set4tm {
namespace {

/// Adds the shapes of a reply with `least` to `most` bytes and a checksum of `tail` bytes, in both
/// address forms: a meter can answer with its short or its extended address.
void Allow(Expectation& expect, std::size_t tail, std::size_t least, std::size_t most) {
  expect.shapes.push_back({kShortForm, 1 + least + tail, 1 + most + tail});
  expect.shapes.push_back({kExtendedForm, 5 + least + tail, 5 + most + tail});
}

}  // namespace

Expectation Expect(View request, const Settings& settings) {
  const Checksum checksum = settings.checksum;
  const std::size_t tail = SizeOf(checksum);
  Expectation expect;
  expect.checksum = static_cast<int>(checksum);
  expect.max_bytes = 5 + kMaxData + tail;
  const auto parts = SplitFrame(request, checksum);
  if (!parts) return expect;
  expect.address.assign(parts->address.begin(), parts->address.end());
  const View pdu = parts->body;
  expect.repeatable = pdu[0] != kWrite && pdu[0] != kWriteMemory;
  expect.mirrors = pdu[0] == kLinkTest;
  if (pdu[0] == kOpenChannel && pdu.size() == 1 + kPasswordSize) {
    expect.secrets = {{parts->address.size() + 1, kPasswordSize + tail}};
  }
  if (expect.address[0] == kBroadcast) {
    expect.reply = Expectation::Reply::none;
    return expect;
  }
  Allow(expect, tail, 1, 1);
  if (AnsweredByStatus(pdu)) return expect;
  const auto data = LengthOfData(pdu);
  // SET-4TM.03 can send two more bytes after the id (reference, chapter 11).
  const std::size_t more = pdu[0] == kMemoryTagged ? 2 : 0;
  Allow(expect, tail, data.value_or(2), data ? *data + more : kMaxData);
  return expect;
}

// The rules cut SET-4TM requests and replies by their known length and checksum.
//
//   > C8 | 08 1B 00 11 | 77 BB                   address 200: voltage of phase 1 as a float
//   < C8 | 00 80 66 43 | AE 69                   230.5 V
//   < C8 | 05 | CRC                              or status 5: channel not open
//   > FC 00 89 A2 61 | 08 00 | 8F 76             extended address 9020001: serial number
//   < FC 00 89 A2 61 | 00 89 A2 61 06 09 02 | 58 BB
//
// USB adapters and serial servers lose the silence that ends a frame (8 ms at 9600 bit/s), so it
// cannot separate frames.

namespace {

constexpr std::size_t kStatusBody = 1;

Checksum ChecksumOf(const Expectation& expect) { return static_cast<Checksum>(expect.checksum); }

/// True if the frame is a status with zeros after it (a break on the line), which must not be read
/// as data. Zeros after a good frame keep its checksum good: CRC-16 has no final XOR, and KS is the
/// XOR of the bytes.
bool IsStatusAndZeros(View frame, Checksum checksum) {
  const std::size_t status = AddressLength(frame[0]) + kStatusBody + SizeOf(checksum);
  return frame.size() > status && EndsInChecksum(frame.first(status), checksum) &&
         std::ranges::all_of(frame.subspan(status), [](std::uint8_t byte) { return byte == 0; });
}

/// True if the reply has the short address of another meter. The conversation checks extended
/// addresses.
bool IsFromAnother(View frame, const Expectation& expect) {
  if (frame[0] == kExtendedPrefix || expect.address.size() != 1) return false;
  return frame[0] != expect.address[0] && expect.address[0] != kCommonAddress;
}

}  // namespace

// Cuts requests. The code and its parameter define the length. Some parameters have an optional
// byte: the request is cut without it if the checksum fits. A code without a known length is cut
// only at silence.
Cut RequestRule(View held, const Expectation& expect, bool idle) {
  const Checksum checksum = ChecksumOf(expect);
  const std::size_t tail = SizeOf(checksum);
  const std::size_t head = AddressLength(held[0]);
  const auto length =
      held.size() > head ? LengthOfRequest(held.subspan(head)) : std::optional<RequestLength>();
  if (length) {
    const std::size_t most = head + length->max + tail;
    if (length->known) {
      const std::size_t limit = std::min(most, held.size());
      for (std::size_t size = head + length->min + tail; size <= limit; ++size) {
        if (EndsInChecksum(held.first(size), checksum)) return Cut::Frame(size);
      }
    } else if (idle && held.size() >= head + length->min + tail && held.size() <= most &&
               EndsInChecksum(held, checksum)) {
      return Cut::Frame(held.size());
    }
    if (held.size() >= most) return cut::BadChecksum();
  }
  return cut::Wait(idle);
}

// Cuts replies. A reply repeats nothing of its request. A frame with the longest expected length
// and a good checksum is cut at once. A shorter frame is cut only at silence, because the first
// bytes of longer data can have a good checksum by chance. It is a status in place of data, or a
// late reply to another request; the conversation tells them apart by their lengths.
Cut ReplyRule(View held, const Expectation& expect, bool idle) {
  const Checksum checksum = ChecksumOf(expect);
  const int form = held[0] == kExtendedPrefix ? kExtendedForm : kShortForm;
  std::size_t longest = 0;
  for (const Shape& shape : expect.shapes) {
    if (shape.tag == form) longest = std::max(longest, shape.max_length);
  }
  if (longest == 0)
    return Cut::Discard(1, Outcome::corrupt, "the request has no reply of this form");
  const bool another = IsFromAnother(held, expect);
  const auto whole = [another](std::size_t size) {
    return another ? cut::OfAnother(size) : Cut::Frame(size);
  };
  if (held.size() >= longest && EndsInChecksum(held.first(longest), checksum)) {
    if (!IsStatusAndZeros(held.first(longest), checksum)) return whole(longest);
    return Cut::Discard(1, Outcome::corrupt, "the bytes can be data, or a status and zeros");
  }
  if (another && held.size() >= longest) return cut::BadChecksum();
  if (!idle) return Cut::NeedMore();
  const std::size_t shortest = AddressLength(held[0]) + kStatusBody + SizeOf(checksum);
  if (held.size() >= shortest && EndsInChecksum(held, checksum)) return whole(held.size());
  return held.size() >= longest ? cut::BadChecksum() : cut::Wait(idle);
}

namespace {

constexpr config::SerialSettings Odd(int baud) {
  return {.baud = baud, .parity = config::Parity::odd};
}

constexpr config::SerialSettings kSerials[] = {
    Odd(9600),  {.baud = 9600},  Odd(19200), {.baud = 19200}, Odd(4800),
    Odd(38400), {.baud = 38400}, Odd(2400),  Odd(1200),       {.baud = 4800}};

constexpr ScanMode kModes[] = {{}, {"checksum", "ks"}};

constexpr std::size_t kLink = 0;
/// Number of data bytes in the reply: serial number and date of manufacture.
constexpr std::size_t kSerialReply = 7;

Checksum ChecksumOf(std::size_t mode) { return mode == 1 ? Checksum::ks : Checksum::crc; }

Bytes AskMeter(unsigned address, std::size_t mode, std::size_t question) {
  const Bytes own = {static_cast<std::uint8_t>(address)};
  const Bytes pdu = question == kLink ? Bytes{kLinkTest} : Bytes{kRead, kSerialNumber};
  return MakeFrame(own, pdu, ChecksumOf(mode));
}

Sighting JudgeMeter(View request, View frame, std::size_t mode) {
  const auto asked = SplitFrame(request, ChecksumOf(mode));
  const auto reply = SplitFrame(frame, ChecksumOf(mode));
  Sighting sighting;
  if (!asked || !reply) return sighting;
  // A meter can be set to answer with its extended address, whichever address the request had.
  const bool extended = reply->address.size() > 1;
  if (!extended && !std::ranges::equal(reply->address, asked->address)) return sighting;
  if (asked->body[0] == kLinkTest) {
    if (reply->body.size() == 1) sighting.what = Sighting::What::maybe;
    return sighting;
  }
  if (reply->body.size() != 1 && reply->body.size() != kSerialReply) return sighting;
  sighting.what = Sighting::What::device;
  if (reply->body.size() != kSerialReply) return sighting;
  sighting.identity = "serial " + std::to_string(*ByteReader(reply->body).U32Be(0));
  return sighting;
}

}  // namespace

const ScanRule kScan = {.serials = kSerials,
                        .first_address = 1,
                        .last_address = 239,
                        .modes = kModes,
                        .questions = 2,
                        .usual = 120ms,
                        .assumed_profile = "set-4tm.03m",
                        .ask = AskMeter,
                        .judge = JudgeMeter};

namespace {

/// Makes a whole frame of typed bytes: adds the check value to `C8 08 00`, unless the bytes end
/// with a correct CRC.
Result<Bytes> CompleteFrame(View written, const Settings& settings) {
  Bytes frame(written.begin(), written.end());
  const Checksum checksum = settings.checksum;
  if (frame.size() < 2 || frame.size() > kMaxData) {
    return Error{"a SET-4TM telegram is an address and a request in hex, as in 'C8 08 00'"};
  }
  // A KS of one byte is correct by chance too often, so the last byte is never taken for a KS.
  const bool whole = checksum == Checksum::crc && frame.size() > 3 && SplitFrame(frame, checksum);
  if (!whole) AppendChecksum(frame, checksum);
  return frame;
}

bool IsReadCode(std::uint8_t code) {
  switch (code) {
    case kLinkTest:
    case kJournal:
    case kEnergy:
    case kMemory:
    case kRead:
    case kJournalExtended:
    case kEnergyExtended:
    case kMemoryTagged:
      return true;
    default:
      return false;
  }
}

bool IsRead(View request, const Settings& settings) {
  const auto parts = SplitFrame(request, settings.checksum);
  if (!parts || parts->address[0] == kBroadcast || !IsReadCode(parts->body[0])) return false;
  const auto length = LengthOfRequest(parts->body);
  return length && length->known && parts->body.size() >= length->min &&
         parts->body.size() <= length->max;
}

}  // namespace

const TelegramRule kTelegram = {"", kWithSettings<CompleteFrame>, kWithSettings<IsRead>};

namespace {

/// The shortest frame with a KS: address, status, KS. Shorter frames prove nothing, as a KS is
/// correct by chance in one of 256 frames.
constexpr std::size_t kShortestKs = 3;
/// Shortest PDU of a read: code and parameter.
constexpr std::size_t kShortestRead = 2;

/// Address of the GSM communicator, which answers in place of a meter that is silent.
constexpr std::uint8_t kCommunicator = 0xFD;

bool IsOfCommunicator(const Parts& reply) {
  return reply.address[0] == kCommunicator && reply.body.size() == 1 &&
         CodeOf(reply.body[0]) == kMeterSilent;
}

std::string Meter(View address) { return "meter " + FormatAddress(address); }

std::string RemedyFor(const Parts& reply) {
  if (reply.address[0] != kExtendedPrefix) return "check the address that is set in the meter";
  const std::string number = FormatAddress(reply.address).substr(std::string_view("sn:").size());
  return "set serial_number: " + number + " in the configuration, if that is the right meter";
}

/// Finds a whole request of another master in the received bytes. Requests that are shorter than a
/// read look like replies, so they are not reported.
std::optional<Recognised> FindRequest(View request, View heard, Checksum checksum) {
  const std::size_t tail = SizeOf(checksum);
  for (std::size_t at = 0; at < heard.size(); ++at) {
    const View held = heard.subspan(at);
    const std::size_t head = AddressLength(held[0]);
    if (held.size() <= head + tail) break;
    const auto length = LengthOfRequest(held.subspan(head));
    if (!length || !length->known || length->max < kShortestRead) continue;
    const std::size_t size = head + length->max + tail;
    if (held.size() < size || !EndsInChecksum(held.first(size), checksum)) continue;
    if (std::ranges::equal(held.first(size), request)) continue;
    return Recognised{Recognised::What::other_master,
                      "another master sends on the line: it has asked " + Meter(held.first(head)),
                      "a serial line can have only one master; remove the other master"};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Recognised> Recognise(View request, View heard, const Settings& settings) {
  const Checksum checksum = settings.checksum;
  auto asked = SplitFrame(request, checksum);
  if (!asked) asked = SplitFrame(request, Other(checksum));
  if (!asked) return std::nullopt;
  const bool any = asked->address.size() == 1 && asked->address[0] == kCommonAddress;
  if (auto other = FindRequest(request, heard, checksum)) return other;
  if (const auto reply = SplitFrame(heard, checksum)) {
    if (any || std::ranges::equal(reply->address, asked->address)) return std::nullopt;
    if (IsOfCommunicator(*reply)) {
      return Recognised{Recognised::What::other_reply,
                        "the GSM communicator (253) reports that the meter does not answer",
                        "check power, wiring and address of the meter behind the communicator"};
    }
    return Recognised{
        Recognised::What::other_device,
        Meter(reply->address) + " answers where " + Meter(asked->address) + " was asked",
        RemedyFor(*reply)};
  }
  const bool ks = checksum == Checksum::crc;
  if (ks && heard.size() > 3) {
    Bytes swapped(heard.begin(), heard.end());
    std::swap(swapped[swapped.size() - 1], swapped[swapped.size() - 2]);
    const auto reply = SplitFrame(swapped, checksum);
    if (reply && std::ranges::equal(reply->address, asked->address)) {
      return Recognised{Recognised::What::other_setting, "its CRC has the high byte first",
                        "check the meter and any converter before it, because one of them does not "
                        "follow the protocol"};
    }
  }
  const auto other = SplitFrame(heard, Other(checksum));
  if (!other || (ks && heard.size() < kShortestKs)) return std::nullopt;
  if (!std::ranges::equal(other->address, asked->address)) return std::nullopt;
  return Recognised{Recognised::What::other_setting,
                    ks ? "its replies end in a sum of one byte, not in a CRC"
                       : "its replies end in a CRC, not in a sum of one byte",
                    std::string("set checksum: ") + (ks ? "ks" : "crc") + " in the configuration"};
}

}  // namespace baudgate::protocols::set4tm
