// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/datagram_check.h"

#include <algorithm>
#include <utility>

namespace baudgate::dds {
namespace {

constexpr std::uint8_t kSecBody = 0x30;
constexpr std::uint8_t kSecPrefix = 0x31;
constexpr std::uint8_t kSecPostfix = 0x32;
constexpr std::uint8_t kMessagePrefix = 0x33;
constexpr std::uint8_t kMessagePostfix = 0x34;

constexpr std::size_t kCryptoHeader = 20;  // bytes: kind, key id, session id (4 each), suffix (8)
constexpr std::size_t kMac = 16;
constexpr std::size_t kReceiverMac = 20;  // bytes: key id (4), MAC (16)
constexpr std::uint32_t kMostReceivers = 256;

// Size in bytes of the head of a handshake message: two identities (24 each), three GUIDs (16
// each).
constexpr std::size_t kMessageIds = 2 * 24 + 3 * 16;

constexpr std::size_t kHandshakeSources = 64;
constexpr std::size_t kBurst = 512;
constexpr Duration kInterval = Duration(1s) / 128;
constexpr std::size_t kBurstOfAddress = kBurst / 2;
constexpr Duration kIntervalOfAddress = kInterval * 2;

/// Reads serialized (CDR) data step by step. fits() is false once a field has ended behind the
/// payload.
class SecuredWalk {
 public:
  SecuredWalk(const RtpsFields& fields, std::size_t at) : fields_(fields), at_(at) {}

  bool fits() const { return fits_; }
  std::uint32_t Number() {
    at_ = (at_ + 3) & ~std::size_t{3};
    const auto number = fields_.U32(at_);
    fits_ = fits_ && number.has_value();
    at_ += 4;
    return fits_ ? *number : 0;
  }
  void Counted() {
    const std::size_t length = Number();
    fits_ = fits_ && length <= fields_.size() - at_;
    if (fits_) at_ += length;
  }
  /// Skips a sequence of properties: pairs of a name and a text, or of a name and bytes.
  void Properties() {
    for (std::uint32_t left = Number(); fits_ && left > 0; --left) {
      Counted();
      Counted();
    }
  }

 private:
  const RtpsFields& fields_;
  std::size_t at_;
  bool fits_ = true;
};

bool HasRoom(Instant& full_at, Duration interval, std::size_t burst, Instant now) {
  const Instant after = std::max(full_at, now) + interval;
  return after - now <= interval * static_cast<std::int64_t>(burst);
}

/// True if the lengths in `body` fit. `id`: id of a DDS Security submessage (kFirstSecured or
/// above).
bool SecuredFits(std::uint8_t id, const RtpsFields& body) {
  // The fields are big-endian, regardless of the endianness flag.
  switch (id) {
    case kSecPrefix:
    case kMessagePrefix:
      return body.size() >= kCryptoHeader;
    case kSecBody: {
      const auto length = body.Entity(0);
      return length && *length <= body.size() - 4;
    }
    case kSecPostfix:
    case kMessagePostfix: {
      const auto count = body.Entity(kMac);
      return count && *count <= kMostReceivers && *count * kReceiverMac <= body.size() - kMac - 4;
    }
    default:
      return true;
  }
}

/// True if `payload` is a well-formed ParticipantGenericMessage (a message of the DDS Security
/// handshake): ids, a class and a sequence of tokens. `payload` begins after the encapsulation.
bool IsGenericMessage(View payload, bool little) {
  const RtpsFields fields(payload, little);
  if (payload.size() < kMessageIds) return false;
  SecuredWalk walk(fields, kMessageIds);
  walk.Counted();  // the class of the message
  for (std::uint32_t left = walk.Number(); walk.fits() && left > 0; --left) {
    walk.Counted();  // the class of a token
    walk.Properties();
    walk.Properties();
  }
  return walk.fits();
}

}  // namespace

bool SecuredOrder::Next(std::uint8_t id, bool first) {
  inside_ = open();
  if (ended_) return false;
  switch (id) {
    case kMessagePrefix:
      message_ = first;
      return first;
    case kMessagePostfix: {
      const bool right = message_ && step_ == Step::outside;
      message_ = false;
      ended_ = true;
      return right;
    }
    case kSecPrefix: {
      const bool right = step_ == Step::outside;
      step_ = Step::prefix;
      return right;
    }
    case kSecBody:
      if (step_ == Step::outside) return message_;
      [[fallthrough]];
    default:
      // Between prefix and postfix only one submessage is allowed; so 31 … 30 … 30 … is refused.
      if (step_ == Step::body) return false;
      if (step_ == Step::prefix) step_ = Step::body;
      return true;
    case kSecPostfix: {
      const bool right = step_ == Step::body;
      step_ = Step::outside;
      return right;
    }
  }
}

HandshakeBudget::HandshakeBudget() { sources_.reserve(kHandshakeSources); }

bool HandshakeBudget::Take(std::uint32_t address, Instant now) {
  auto at = std::ranges::find(sources_, address, &Source::address);
  if (at == sources_.end()) {
    if (sources_.size() == kHandshakeSources) {
      at = std::ranges::min_element(sources_, {}, &Source::full_at);
      *at = {address, {}};
    } else {
      at = sources_.insert(sources_.end(), Source{address, {}});
    }
  }
  if (!HasRoom(at->full_at, kIntervalOfAddress, kBurstOfAddress, now) ||
      !HasRoom(full_at_, kInterval, kBurst, now)) {
    return false;
  }
  at->full_at = std::max(at->full_at, now) + kIntervalOfAddress;
  full_at_ = std::max(full_at_, now) + kInterval;
  return true;
}

namespace {

// The longest announcement of a reader or writer in bytes, without the description of its type;
// Fast DDS needs about 500.
constexpr std::size_t kMostOfEndpoint = 8192;
constexpr std::size_t kMostNumbersInSet = 256;   // RTPS 2.3, 8.3.5.5
constexpr std::uint8_t kMaker[] = {0x01, 0x0F};  // vendor id of eProsima, who make Fast DDS

bool IsDiscovery(std::uint32_t entity) {
  // FF 00 03 C2 is the encrypted form of 00 00 03 C2 (DDS Security 1.1, 7.4.6).
  if (entity >> 24 == 0xFF) entity &= 0x00FFFFFF;
  return entity == kParticipantWriter || entity == kParticipantReader ||
         entity == kPublicationsWriter || entity == kPublicationsReader ||
         entity == kSubscriptionsWriter || entity == kSubscriptionsReader;
}

/// Returns the size in bytes of the set of sequence numbers at `at`: base (8), count (4), one bit
/// per number. 0: the set is invalid.
std::size_t SetSize(const RtpsFields& body, std::size_t at) {
  const auto base = body.SequenceNumber(at);
  const auto count = body.U32(at + 8);
  if (!base || !count || *base < 0 || *count > kMostNumbersInSet) return 0;
  const std::size_t size = 12 + (*count + 31) / 32 * 4;
  return body.Slice(at, size) ? size : 0;
}

Edit ShortLease(std::size_t at, bool little, Duration lease) {
  Edit edit{.at = at};
  const auto seconds = static_cast<std::uint32_t>(lease / 1s);
  for (std::size_t i = 0; i < 4; ++i) {
    edit.bytes[little ? i : 3 - i] = static_cast<std::uint8_t>(seconds >> (8 * i));
  }
  return edit;
}

// True if `payload` contains a ParticipantMessageData after the encapsulation: GUID prefix (12),
// kind (4), length (4), and as many bytes (RTPS 2.3, 9.6.3.1).
bool IsLivelinessMessage(View payload, bool little) {
  const RtpsFields fields(payload.subspan(kEncapsulation), little);
  const auto count = fields.U32(16);
  return count && *count <= fields.size() - 20;
}

}  // namespace

struct DatagramCheck::Submessage {
  std::uint8_t id = 0;
  std::uint8_t flags = 0;
  std::size_t at = 0;  ///< offset of the body in the datagram
  RtpsFields body;
  /// True: the length field is 0, which means that the submessage extends to the end of the
  /// datagram.
  bool is_last = false;
};

struct DatagramCheck::Walk {
  Sender sender{};
  Instant now{};
  GuidPrefix source{};
  bool by_maker = false;
  SecuredOrder order{};
  Verdict verdict{};
};

DatagramCheck::DatagramCheck(const CheckOptions& options)
    : security_(options.security),
      servers_(options.servers),
      participants_(options.participants),
      window_(options.window),
      endpoints_(options.endpoints) {}

Verdict DatagramCheck::Check(View datagram, Sender sender, Instant now) {
  Walk walk{.sender = sender, .now = now};
  const auto refused = [](Refusal reason) { return Verdict{.reason = reason}; };
  if (datagram.size() < kRtpsHeader || !AsText(datagram).starts_with("RTPS") || datagram[4] != 2) {
    return refused(Refusal::not_rtps);
  }
  walk.by_maker = datagram[6] == kMaker[0] && datagram[7] == kMaker[1];
  walk.source = PrefixOf(datagram.subspan(8));
  participants_.Heard(walk.source, now);
  walk.verdict.length = datagram.size();
  bool vendors_only = false;
  for (std::size_t at = kRtpsHeader; at < datagram.size();) {
    if (datagram.size() - at < 4) return refused(Refusal::length);
    const std::uint8_t id = datagram[at];
    const std::uint8_t flags = datagram[at + 1];
    const RtpsFields header(datagram.subspan(at, 4), (flags & kLittleEndian) != 0);
    std::size_t length = *header.U16(2);
    if (length > datagram.size() - at - 4) return refused(Refusal::length);
    const bool is_last = length == 0 && id != kPad && id != kInfoTimestamp;
    if (is_last) length = datagram.size() - at - 4;
    if (id >= kFirstVendor && !walk.order.open()) {
      // Submessages of vendors at the end of the datagram are cut off. Example: Fast DDS 2.9
      // terminates the process for statistics (80 01 38 00 …) with a lower number than the previous
      // ones.
      if (!vendors_only) walk.verdict.length = at;
      vendors_only = true;
    } else {
      if (vendors_only && walk.by_maker) return refused(Refusal::vendor_submessage);
      vendors_only = false;
      if (security_ != Secured::off && !walk.order.Next(id, at == kRtpsHeader)) {
        return refused(Refusal::secured);
      }
      walk.verdict.length = datagram.size();
      const Submessage submessage{id, flags, at + 4,
                                  RtpsFields(datagram.subspan(at + 4, length), header.little()),
                                  is_last};
      const Refusal reason = CheckSubmessage(submessage, walk);
      if (reason != Refusal::none) return refused(reason);
    }
    // Fast DDS expects the next submessage at a multiple of four bytes.
    at += 4 + ((length + 3) & ~std::size_t{3});
    if (is_last) break;
  }
  if (!walk.order.complete()) return refused(Refusal::secured);
  return walk.verdict;
}

/// True if the submessage is protected (encrypted or signed), or need not be: the governance does
/// not demand it, the submessage contains no data, or it belongs to the discovery or handshake of
/// participants, which have no keys yet.
bool DatagramCheck::MayBeClear(const Submessage& submessage, const Walk& walk) const {
  if (security_ != Secured::demanded || walk.order.inside()) return true;
  if (submessage.id != kData && submessage.id != kHeartbeat && submessage.id != kGap &&
      submessage.id != kAckNack) {
    return true;
  }
  const std::size_t at = submessage.id == kData ? 4 : 0;
  const auto reader = submessage.body.Entity(at);
  const auto writer = submessage.body.Entity(at + 4);
  return reader && writer && (*writer == kParticipantWriter || *writer == kHandshakeWriter) &&
         (*reader == 0 || *reader == kParticipantReader || *reader == kHandshakeReader);
}

Refusal DatagramCheck::CheckSubmessage(const Submessage& submessage, Walk& walk) {
  const RtpsFields& body = submessage.body;
  if (!MayBeClear(submessage, walk)) return Refusal::clear_text;
  switch (submessage.id) {
    case kData:
      return CheckData(submessage, walk);
    case kDataFragment:  // refuses e.g. 16 03 24 00 …, which has inline QoS but no payload
    case kHeartbeatFragment:
    case kNackFragment:
      return Refusal::fragment;
    case kHeartbeat:
      return CheckHeartbeat(submessage, walk);
    case kGap:
      return CheckGap(submessage, walk);
    case kAckNack: {
      // Example of a refused set: 06 01 … 01 00 00 00 FF FF FF FF claims 4294967295 numbers
      // (8.3.7.1.3).
      const std::size_t set = SetSize(body, 8);
      if (set == 0) return Refusal::numbers;
      // An ACKNACK whose base is 2 or more acknowledges number 1, our first announcement of a
      // writer. So the participant receives what we send.
      if (*body.Entity(4) == kPublicationsWriter && *body.SequenceNumber(8) > 1) {
        participants_.Confirmed(walk.source);
      }
      return body.Slice(8 + set, 4) ? Refusal::none : Refusal::length;
    }
    case kInfoTimestamp:
      return (submessage.flags & kNoTimestamp) != 0 || body.size() >= 8 ? Refusal::none
                                                                        : Refusal::length;
    case kInfoDestination:
      return body.size() >= 12 ? Refusal::none : Refusal::length;
    case kInfoSource:
      if (body.size() < 20) return Refusal::length;
      walk.source = PrefixOf(body.From(8));
      return Refusal::none;
    default:
      if (submessage.id < kFirstSecured || submessage.id > kLastSecured) return Refusal::none;
      if (security_ == Secured::off) return Refusal::security;
      return SecuredFits(submessage.id, body) ? Refusal::none : Refusal::secured;
  }
}

// Layout of a DATA submessage in bytes: extra flags (2), distance to the inline QoS (2), reader
// (4), writer (4), sequence number (8), inline QoS, payload.
Refusal DatagramCheck::CheckData(const Submessage& submessage, Walk& walk) {
  const RtpsFields& body = submessage.body;
  const auto to_qos = body.U16(2);
  const auto reader = body.Entity(4);
  const auto writer = body.Entity(8);
  const auto number = body.SequenceNumber(12);
  if (!number) return Refusal::length;
  if (*number < 1) return Refusal::numbers;
  const bool payload = (submessage.flags & kPayload) != 0;
  const bool key = (submessage.flags & kKey) != 0;
  if (payload && key) return Refusal::data;
  std::size_t at = 4 + std::size_t{*to_qos};
  // Example of a refused submessage: in 15 05 … FF FF, the inline QoS begins 65535 bytes later. At
  // a distance below 16 it would overlap the sequence number.
  if (*to_qos < 16 || at > body.size()) return Refusal::data;
  Parameters qos;
  if ((submessage.flags & kInlineQos) != 0) {
    const Refusal reason =
        CheckParameters(body.From(at), body.little(), security_ != Secured::off, qos);
    if (reason != Refusal::none) return reason;
    at += qos.size;
  }
  // Example of a refused submessage: 15 07 … has nothing after the inline QoS, so the library would
  // compute a negative payload size.
  if ((payload || key) && body.size() - at < kEncapsulation) return Refusal::data;
  if (!Advance(walk, *writer, *number, 0)) return Refusal::window;
  if (payload || key) return CheckPayload(submessage, at, *reader, *writer, qos.status, walk);
  // A participant that leaves can send only the hash of its key, without a payload.
  if (*writer == kParticipantWriter && qos.status != 0 && qos.participant) {
    participants_.Left(*qos.participant);
    endpoints_.ParticipantLeft(*qos.participant);
  } else if (IsDiscovery(*writer) && qos.status != 0 && qos.endpoint) {
    endpoints_.Left(*qos.endpoint);
  }
  return Refusal::none;
}

Refusal DatagramCheck::CheckPayload(const Submessage& submessage, std::size_t at,
                                    std::uint32_t reader, std::uint32_t writer,
                                    std::uint32_t status, Walk& walk) {
  const View payload = submessage.body.From(at);
  const std::uint16_t kind = *ByteReader(payload).U16Be(0);
  if (writer == kLivelinessWriter || reader == kLivelinessReader) {
    const bool little = (kind & 1) != 0;
    return IsLivelinessMessage(payload, little) ? Refusal::none : Refusal::parameters;
  }
  if (security_ != Secured::off && (writer == kHandshakeWriter || reader == kHandshakeReader)) {
    return CheckHandshake(payload, kind, walk);
  }
  // The reader is checked as well, because the library dispatches by the reader and not by the
  // writer.
  if (!IsDiscovery(writer) && !IsDiscovery(reader)) return Refusal::none;
  const bool key = (submessage.flags & kKey) != 0;
  if (kind != kParametersBig && kind != kParametersLittle) return Refusal::parameters;
  Parameters announced;
  const bool little = kind == kParametersLittle;
  const Refusal reason = CheckParameters(payload.subspan(kEncapsulation), little,
                                         security_ != Secured::off, announced);
  if (reason != Refusal::none) return reason;
  const std::size_t list_at = submessage.at + at + kEncapsulation;
  // A protected announcement is not changed, because its signature would no longer match.
  if (!walk.order.inside() && !Hide(announced, list_at, walk.verdict)) {
    return Refusal::parameters;
  }
  const bool gone = key || status != 0;
  if (writer != kParticipantWriter && reader != kParticipantReader) {
    return AdmitEndpoint(announced, gone, walk.now);
  }
  return Admit(announced, list_at, little, gone, walk);
}

/// Adds the parameters that the library must not see to `verdict.hidden`. False: there are too
/// many.
bool DatagramCheck::Hide(const Parameters& announced, std::size_t list_at, Verdict& verdict) const {
  const auto hide = [&](std::span<const std::size_t> places) {
    if (places.size() > verdict.hidden.size() - verdict.hidden_count) return false;
    for (const std::size_t at : places) {
      verdict.hidden[verdict.hidden_count++] = static_cast<std::uint16_t>(list_at + at);
    }
    return true;
  };
  return hide(std::span(announced.groups).first(announced.group_count)) &&
         hide(std::span(announced.types).first(announced.type_count));
}

Refusal DatagramCheck::AdmitEndpoint(const Parameters& announced, bool gone, Instant now) {
  if (!announced.endpoint) return Refusal::none;
  if (gone) {
    endpoints_.Left(*announced.endpoint);
    return Refusal::none;
  }
  if (announced.size - announced.type_bytes > kMostOfEndpoint) return Refusal::parameters;
  return endpoints_.Announce(*announced.endpoint, participants_, now) ? Refusal::none
                                                                      : Refusal::endpoints;
}

Refusal DatagramCheck::CheckHandshake(View payload, std::uint16_t kind, const Walk& walk) {
  const bool little = kind == kCdrLittle || kind == kParametersLittle;
  if (!little && kind != kCdrBig && kind != kParametersBig) return Refusal::secured;
  if (!IsGenericMessage(payload.subspan(kEncapsulation), little)) return Refusal::secured;
  return handshakes_.Take(walk.sender.address, walk.now) ? Refusal::none : Refusal::handshakes;
}

Refusal DatagramCheck::Admit(const Parameters& announced, std::size_t list_at, bool little,
                             bool gone, Walk& walk) {
  if (!announced.participant) return Refusal::parameters;
  if (gone) {
    participants_.Left(*announced.participant);
    endpoints_.ParticipantLeft(*announced.participant);
    return Refusal::none;
  }
  // An announcement without a lease counts as 100 s (RTPS 2.3, table 9.14), and 02 00 08 00 FF FF
  // FF 7F … is an infinite lease: both are longer than the longest lease.
  const ParticipantLimits& limits = participants_.limits();
  const Duration lease =
      announced.lease_at ? Duration(announced.lease_seconds * 1s) + 1s : limits.longest_lease;
  const Refusal reason = participants_.Announce(*announced.participant,
                                                AddressOf(announced, walk.sender), lease, walk.now);
  if (reason != Refusal::none) return reason;
  Describe(announced, walk.sender);
  if (announced.lease_at && Duration(announced.lease_seconds * 1s) > limits.longest_lease) {
    Verdict& verdict = walk.verdict;
    if (verdict.edit_count == verdict.edits.size()) return Refusal::parameters;
    verdict.edits[verdict.edit_count++] =
        ShortLease(list_at + *announced.lease_at, little, limits.longest_lease);
  }
  return Refusal::none;
}

void DatagramCheck::Describe(const Parameters& announced, Sender sender) {
  const std::span at(announced.metatraffic.data(), announced.metatraffic_count);
  if (at.empty()) return;
  const auto own = std::ranges::find(at, sender.address, &UdpAddress::address);
  participants_.Describe(*announced.participant, own == at.end() ? at.front() : *own,
                         own != at.end(),
                         AsText(announced.user_data) != UserDataOf(Role::publishes));
}

std::uint32_t DatagramCheck::AddressOf(const Parameters& announced, Sender sender) const {
  const bool passed_on = std::ranges::find(servers_, sender) != servers_.end();
  return passed_on && announced.metatraffic_count > 0 ? announced.metatraffic[0].address
                                                      : sender.address;
}

// Layout of a HEARTBEAT in bytes: reader (4), writer (4), first number (8), last number (8), count
// (4).
Refusal DatagramCheck::CheckHeartbeat(const Submessage& submessage, Walk& walk) {
  const RtpsFields& body = submessage.body;
  const auto first = body.SequenceNumber(8);
  const auto last = body.SequenceNumber(16);
  if (body.size() < 28) return Refusal::length;
  // Example of a refused submessage: in 07 01 … 00 00 00 80 00 00 00 00, `last` is -2^63. The value
  // last == first - 1 is allowed: it means "no samples" (8.3.7.5.3).
  if (*first < 1 || *last < *first - 1) return Refusal::numbers;
  // Example of a refused submessage: in 07 01 … 00 01 00 00 00 00 00 00, the number is 2^40, and
  // the library would count to it for hours.
  return Advance(walk, *body.Entity(4), *last, 0) ? Refusal::none : Refusal::window;
}

// Layout of a GAP in bytes: reader (4), writer (4), start (8), set of sequence numbers.
Refusal DatagramCheck::CheckGap(const Submessage& submessage, Walk& walk) {
  const RtpsFields& body = submessage.body;
  const auto start = body.SequenceNumber(8);
  if (!start) return Refusal::length;
  if (SetSize(body, 16) == 0) return Refusal::numbers;
  const std::int64_t base = *body.SequenceNumber(16);
  if (*start < 1 || base < 1) return Refusal::numbers;
  const std::int64_t skipped = base > *start ? base - *start : 0;
  return Advance(walk, *body.Entity(4), base - 1, skipped) ? Refusal::none : Refusal::window;
}

bool DatagramCheck::Advance(const Walk& walk, std::uint32_t writer, std::int64_t to,
                            std::int64_t skipped) {
  Guid guid{};
  std::copy(walk.source.begin(), walk.source.end(), guid.begin());
  for (std::size_t i = 0; i < 4; ++i) {
    guid[12 + i] = static_cast<std::uint8_t>(writer >> (24 - 8 * i));
  }
  return window_.Advance(guid, to, skipped, walk.now);
}

namespace {

constexpr Duration kSilence = 10s;

std::string Line(Refusal reason, Sender sender, std::uint64_t folded) {
  return "refused " + std::string(Words(reason)) + " from " + Text(sender) + " (" +
         std::to_string(folded) + " more refused before)";
}

}  // namespace

DatagramGate::DatagramGate(const CheckOptions& options, Tell tell)
    : tell_(std::move(tell)), check_(options) {}

std::span<std::uint8_t> DatagramGate::LetIn(std::span<std::uint8_t> datagram, Sender sender,
                                            Instant now) {
  const MutexLock lock(mutex_);
  const Verdict verdict = check_.Check(datagram, sender, now);
  if (!verdict.passes()) {
    ++counters_.refused[static_cast<std::size_t>(verdict.reason)];
    Fold(verdict.reason, sender, now);
    return {};
  }
  ++counters_.passed;
  for (std::size_t i = 0; i < verdict.edit_count; ++i) {
    std::ranges::copy(verdict.edits[i].bytes, datagram.subspan(verdict.edits[i].at).begin());
  }
  for (std::size_t i = 0; i < verdict.hidden_count; ++i) {
    datagram[verdict.hidden[i]] = datagram[verdict.hidden[i] + 1U] = 0;
  }
  return datagram.first(verdict.length);
}

DatagramCounters DatagramGate::counters() const {
  const MutexLock lock(mutex_);
  DatagramCounters counters = counters_;
  counters.participants = static_cast<std::uint32_t>(check_.participants().size());
  return counters;
}

DatagramGate::Known DatagramGate::known(Instant now) const {
  const MutexLock lock(mutex_);
  return {check_.participants().Reached(now), check_.participants().Unanswered(now)};
}

void DatagramGate::Fold(Refusal reason, Sender sender, Instant now) {
  if (now < silent_until_) {
    ++folded_;
    return;
  }
  silent_until_ = now + kSilence;
  if (tell_) tell_(Line(reason, sender, folded_));
  folded_ = 0;
}

}  // namespace baudgate::dds
