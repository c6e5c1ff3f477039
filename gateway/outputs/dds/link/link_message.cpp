// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/link_message.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/outputs/dds/published_types.h"

namespace baudgate::dds {
namespace {

constexpr std::size_t kMostInterfaces = 64;
constexpr std::size_t kMaxAddress = 45;  // length of an IPv6 address as text
constexpr std::size_t kMaxIpv4 = 15;
constexpr std::size_t kMaxSentence = 1000;
constexpr std::size_t kMaxRemark = 255;  // the length is sent as one byte
constexpr std::size_t kMaxPath = 255;    // the length is sent as one byte
constexpr std::size_t kSecurityFiles = 7;
constexpr std::uint32_t kMostInstances = 10'000'000;
constexpr std::uint32_t kMostEventDevices = 1'000'000;
constexpr int kLastDomain = 232;
// Bytes of the message `request` before its sample: participant, entity, time of arrival, time of
// publication, flags.
constexpr std::size_t kArrivalBytes = 12 + 4 + 8 + 8 + 1;
// The counts of subscribers in the order of the message.
constexpr std::uint32_t Subscribers::*kReaders[] = {&Subscribers::points, &Subscribers::devices,
                                                    &Subscribers::events, &Subscribers::alarms};
constexpr unsigned kLasting = 1;
constexpr unsigned kEarly = 2;

static_assert(kLinkHeaderBytes + 1 + kMaxKey + 6 + kMostInterfaces * (1 + kMaxAddress) + 1 + 1 +
                  config::kMostPeers * (1 + kMaxIpv4) + 1 +
                  (config::kMostDiscoveryServers + 1 + Neighbours::kMostReached) * (3 + kMaxIpv4) +
                  16 + 1 + kSecurityFiles * (1 + kMaxPath) <=
              kMaxLinkMessage);
static_assert(kLinkHeaderBytes + kMaxBytes<PointSample> <= kMaxLinkMessage);
static_assert(kLinkHeaderBytes + 76 + kRefusals * 8 + Neighbours::kMostReached * (3 + kMaxIpv4) +
                  Neighbours::kMostRemarks * (1 + kMaxRemark) <=
              kMaxLinkMessage);

void PutHeader(LinkKind kind, std::size_t body, std::span<std::uint8_t> to) {
  to[0] = static_cast<std::uint8_t>(kind);
  to[1] = kLinkVersion;
  to[2] = static_cast<std::uint8_t>(body & 0xFFU);
  to[3] = static_cast<std::uint8_t>(body >> 8);
}

Bytes Packet(LinkKind kind, View body) {
  Bytes packet(kLinkHeaderBytes + body.size());
  PutHeader(kind, body.size(), packet);
  std::ranges::copy(body, packet.begin() + kLinkHeaderBytes);
  return packet;
}

template <typename T>
void Put(Bytes& to, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
}

void PutText(Bytes& to, std::string_view text) {
  to.push_back(static_cast<std::uint8_t>(text.size()));
  Append(to, text);
}

void PutTexts(Bytes& to, const std::vector<std::string>& texts, std::size_t most,
              std::size_t bound) {
  const std::size_t count = std::min(texts.size(), most);
  to.push_back(static_cast<std::uint8_t>(count));
  for (std::size_t i = 0; i < count; ++i) PutText(to, texts[i].substr(0, bound));
}

/// Reads fields from the front of a body. After a missing or bad field, all further fields are 0 or
/// empty, and AllTaken is false.
class Fields {
 public:
  explicit Fields(View rest) : rest_(rest) {}

  template <typename T>
  T Number() {
    T value = 0;
    if (!Has(sizeof(T))) return value;
    for (std::size_t i = 0; i < sizeof(T); ++i) value |= static_cast<T>(T{rest_[i]} << (8 * i));
    rest_ = rest_.subspan(sizeof(T));
    return value;
  }
  std::string Text(std::size_t bound) {
    const auto length = Number<std::uint8_t>();
    if (length > bound || !Has(length)) {
      good_ = false;
      return {};
    }
    std::string text(AsText(rest_.first(length)));
    rest_ = rest_.subspan(length);
    return text;
  }
  std::vector<std::string> Texts(std::size_t most, std::size_t bound) {
    std::vector<std::string> texts(Count(most));
    for (std::string& text : texts) text = Text(bound);
    return texts;
  }
  std::size_t Count(std::size_t most) {
    const auto count = Number<std::uint8_t>();
    good_ = good_ && count <= most;
    return good_ ? count : 0;
  }
  bool AllTaken() const { return good_ && rest_.empty(); }

 private:
  bool Has(std::size_t count) {
    good_ = good_ && rest_.size() >= count;
    return good_;
  }

  View rest_;
  bool good_ = true;
};

void PutPlaces(Bytes& to, const std::vector<config::HostPort>& places, std::size_t most) {
  const std::size_t count = std::min(places.size(), most);
  to.push_back(static_cast<std::uint8_t>(count));
  for (std::size_t i = 0; i < count; ++i) {
    PutText(to, places[i].host.substr(0, kMaxIpv4));
    Put(to, places[i].port);
  }
}

std::vector<config::HostPort> TakePlaces(Fields& fields, std::size_t most) {
  std::vector<config::HostPort> places(fields.Count(most));
  for (config::HostPort& at : places) {
    at.host = fields.Text(kMaxIpv4);
    at.port = fields.Number<std::uint16_t>();
  }
  return places;
}

/// Returns the paths of the security files in the order of the message.
template <typename Security>
auto FilesOf(Security& security) {
  return std::array{&security.ca,         &security.permissions_ca, &security.identity,
                    &security.key,        &security.password_file,  &security.governance,
                    &security.permissions};
}

void PutSecurity(Bytes& to, const config::DdsSecurity& security) {
  to.push_back(security.on() ? kSecurityFiles : 0);
  if (!security.on()) return;
  for (const std::string* file : FilesOf(security)) PutText(to, file->substr(0, kMaxPath));
}

bool TakeSecurity(Fields& fields, config::DdsSecurity& security) {
  const auto count = fields.Number<std::uint8_t>();
  if (count == 0) return true;
  if (count != kSecurityFiles) return false;
  for (std::string* file : FilesOf(security)) *file = fields.Text(kMaxPath);
  return security.on();
}

bool IsKind(std::uint8_t byte) { return (byte >= 1 && byte <= 8) || (byte >= 64 && byte <= 68); }

}  // namespace

Bytes EncodeOpen(const LinkOpen& open) {
  Bytes body;
  PutText(body, open.gateway.substr(0, kMaxKey));
  Put(body, static_cast<std::uint32_t>(open.participant.domain));
  Put(body, static_cast<std::uint32_t>(open.participant.lease / 1ms));
  PutTexts(body, open.participant.interfaces, kMostInterfaces, kMaxAddress);
  body.push_back(open.participant.multicast ? 1 : 0);
  PutTexts(body, open.participant.peers, config::kMostPeers, kMaxIpv4);
  PutPlaces(body, open.participant.discovery_servers, config::kMostDiscoveryServers);
  PutPlaces(body, open.participant.reached, Neighbours::kMostReached);
  Put(body, open.room.points);
  Put(body, open.room.devices);
  body.push_back(open.requests ? 1 : 0);
  Put(body, open.room.events);
  PutSecurity(body, open.participant.security);
  return Packet(LinkKind::open, body);
}

Bytes EncodeFailed(const std::string& sentence) {
  return Packet(LinkKind::failed, ToBytes(sentence.substr(0, kMaxSentence)));
}

Bytes EncodeCounts(const LinkCounts& counts) {
  Bytes body;
  for (const auto readers : kReaders) Put(body, counts.subscribers.*readers);
  Put(body, counts.written);
  Put(body, counts.refused);
  Put(body, counts.dropped);
  Put(body, counts.events_dropped);
  Put(body, counts.datagrams.participants);
  Put(body, counts.datagrams.passed);
  body.push_back(static_cast<std::uint8_t>(kRefusals));
  for (const std::uint64_t refused : counts.datagrams.refused) Put(body, refused);
  PutPlaces(body, counts.neighbours.reached, Neighbours::kMostReached);
  PutTexts(body, counts.neighbours.remarks, Neighbours::kMostRemarks, kMaxRemark);
  return Packet(LinkKind::counts, body);
}

Bytes EncodeBare(LinkKind kind) { return Packet(kind, {}); }

template <typename Sample>
std::size_t EncodeSample(LinkKind kind, const Sample& sample, std::span<std::uint8_t> to) {
  if (to.size() < kMaxLinkMessage) return 0;
  const std::size_t body = Encode(sample, to.subspan(kLinkHeaderBytes));
  if (body == 0) return 0;
  PutHeader(kind, body, to);
  return kLinkHeaderBytes + body;
}
template std::size_t EncodeSample(LinkKind, const PointSample&, std::span<std::uint8_t>);
template std::size_t EncodeSample(LinkKind, const DeviceSample&, std::span<std::uint8_t>);
template std::size_t EncodeSample(LinkKind, const GatewaySample&, std::span<std::uint8_t>);
template std::size_t EncodeSample(LinkKind, const EventSample&, std::span<std::uint8_t>);
template std::size_t EncodeSample(LinkKind, const AlarmSample&, std::span<std::uint8_t>);
template std::size_t EncodeSample(LinkKind, const ReplySample&, std::span<std::uint8_t>);

Bytes EncodeRequest(const WriteArrival& arrival) {
  Bytes body(arrival.writer.publisher.bytes.begin(), arrival.writer.publisher.bytes.end());
  Append(body, arrival.writer.entity);
  Put(body, static_cast<std::uint64_t>(arrival.received.time_since_epoch().count()));
  Put(body, static_cast<std::uint64_t>(arrival.published.time_since_epoch().count()));
  body.push_back(
      static_cast<std::uint8_t>((arrival.lasting ? kLasting : 0U) | (arrival.early ? kEarly : 0U)));
  body.resize(kArrivalBytes + kMaxBytes<RequestSample>);
  const std::size_t size = Encode(arrival.request, std::span(body).subspan(kArrivalBytes));
  if (size == 0) return {};
  body.resize(kArrivalBytes + size);
  return Packet(LinkKind::request, body);
}

Result<LinkMessage> ParseLink(View packet) {
  if (packet.size() < kLinkHeaderBytes) {
    return Error{"a message of " + std::to_string(packet.size()) + " bytes"};
  }
  if (packet.size() > kMaxLinkMessage) return Error{"a message that is too long"};
  if (packet[1] != kLinkVersion) {
    return Error{"a message of version " + std::to_string(packet[1]) + ", not " +
                 std::to_string(kLinkVersion) +
                 "; baudgate and baudgate-dds must be of one release"};
  }
  if (!IsKind(packet[0])) return Error{"a message of unknown kind " + std::to_string(packet[0])};
  const std::size_t body = packet[2] + 256U * packet[3];
  if (body != packet.size() - kLinkHeaderBytes) {
    return Error{"a message of " + std::to_string(packet.size() - kLinkHeaderBytes) +
                 " bytes whose length field is " + std::to_string(body)};
  }
  return LinkMessage{static_cast<LinkKind>(packet[0]), packet.subspan(kLinkHeaderBytes)};
}

Result<LinkOpen> DecodeOpen(View body) {
  const Error damaged{"a damaged request to open DDS"};
  Fields fields(body);
  LinkOpen open;
  open.gateway = fields.Text(kMaxKey);
  const auto domain = fields.Number<std::uint32_t>();
  open.participant.lease = fields.Number<std::uint32_t>() * 1ms;
  open.participant.interfaces = fields.Texts(kMostInterfaces, kMaxAddress);
  const auto multicast = fields.Number<std::uint8_t>();
  open.participant.peers = fields.Texts(config::kMostPeers, kMaxIpv4);
  open.participant.discovery_servers = TakePlaces(fields, config::kMostDiscoveryServers);
  open.participant.reached = TakePlaces(fields, Neighbours::kMostReached);
  open.room.points = fields.Number<std::uint32_t>();
  open.room.devices = fields.Number<std::uint32_t>();
  const auto requests = fields.Number<std::uint8_t>();
  open.room.events = fields.Number<std::uint32_t>();
  if (!TakeSecurity(fields, open.participant.security) || !fields.AllTaken() ||
      domain > kLastDomain || open.participant.lease < config::kShortestLease ||
      open.participant.lease > config::kLongestLease || multicast > 1 ||
      open.room.points > kMostInstances || open.room.devices > kMostInstances || requests > 1 ||
      open.room.events > kMostEventDevices) {
    return damaged;
  }
  open.participant.domain = static_cast<int>(domain);
  open.participant.multicast = multicast == 1;
  open.requests = requests == 1;
  return open;
}

Result<LinkCounts> DecodeCounts(View body) {
  Fields fields(body);
  LinkCounts counts;
  for (const auto readers : kReaders) {
    counts.subscribers.*readers = fields.Number<std::uint32_t>();
  }
  counts.written = fields.Number<std::uint64_t>();
  counts.refused = fields.Number<std::uint64_t>();
  counts.dropped = fields.Number<std::uint64_t>();
  counts.events_dropped = fields.Number<std::uint64_t>();
  counts.datagrams.participants = fields.Number<std::uint32_t>();
  counts.datagrams.passed = fields.Number<std::uint64_t>();
  const bool same_reasons = fields.Number<std::uint8_t>() == kRefusals;
  for (std::uint64_t& refused : counts.datagrams.refused) refused = fields.Number<std::uint64_t>();
  counts.neighbours.reached = TakePlaces(fields, Neighbours::kMostReached);
  counts.neighbours.remarks = fields.Texts(Neighbours::kMostRemarks, kMaxRemark);
  for (std::string& remark : counts.neighbours.remarks) remark = Harmless(remark);
  if (!same_reasons || !fields.AllTaken()) return Error{"damaged counts"};
  return counts;
}

Result<WriteArrival> DecodeRequest(View body) {
  WriteArrival arrival;
  if (body.size() < kArrivalBytes || !Decode(body.subspan(kArrivalBytes), arrival.request)) {
    return Error{"a damaged write request"};
  }
  std::ranges::copy(body.first(12), arrival.writer.publisher.bytes.begin());
  std::ranges::copy(body.subspan(12, 4), arrival.writer.entity.begin());
  Fields fields(body.subspan(16, kArrivalBytes - 16));
  arrival.received = Instant(Duration(static_cast<std::int64_t>(fields.Number<std::uint64_t>())));
  arrival.published = WallTime(Duration(static_cast<std::int64_t>(fields.Number<std::uint64_t>())));
  const auto flags = fields.Number<std::uint8_t>();
  if (flags > (kLasting | kEarly)) return Error{"a damaged write request"};
  arrival.lasting = (flags & kLasting) != 0;
  arrival.early = (flags & kEarly) != 0;
  return arrival;
}

std::string DecodeFailed(View body) {
  return Harmless(std::string(AsText(body.first(std::min(body.size(), kMaxSentence)))));
}

}  // namespace baudgate::dds
