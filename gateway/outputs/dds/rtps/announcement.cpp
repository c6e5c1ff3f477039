// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/rtps/announcement.h"

#include <arpa/inet.h>

#include <algorithm>
#include <tuple>

namespace baudgate::dds {

std::optional<UdpAddress> ParseUdpAddress(const std::string& host, std::uint16_t port) {
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) != 1) return std::nullopt;
  return UdpAddress{ntohl(address.s_addr), port};
}

std::string HostOf(const UdpAddress& at) {
  std::string text;
  for (int shift = 24; shift >= 0; shift -= 8) {
    text += std::to_string((at.address >> shift) & 0xFF);
    if (shift > 0) text += '.';
  }
  return text;
}

std::string Text(const UdpAddress& at) { return HostOf(at) + ":" + std::to_string(at.port); }

namespace {

constexpr std::size_t kSubmessageHeader = 4;
constexpr Duration kUsualLease = 100s;  // RTPS 2.3, table 9.14
// The ports of domain D begin at 7400 + 250 D (9.6.1.1).
constexpr std::uint32_t kFirstPort = 7400;
constexpr std::uint32_t kPortsOfDomain = 250;

struct Submessage {
  std::uint8_t id = 0;
  std::uint8_t flags = 0;
  View body;

  bool little() const { return (flags & kLittleEndian) != 0; }
};

struct Found {
  Submessage time;
  Submessage data;
};

Error Broken(Refusal reason) { return Error{std::string(Words(reason))}; }

Result<Submessage> Next(View datagram, std::size_t& at) {
  const auto header = ByteReader(datagram).Slice(at, kSubmessageHeader);
  if (!header) return Broken(Refusal::length);
  Submessage submessage{(*header)[0], (*header)[1], {}};
  const std::size_t rest = datagram.size() - at - kSubmessageHeader;
  std::size_t length = *RtpsFields(*header, submessage.little()).U16(2);
  if (length > rest) return Broken(Refusal::length);
  const bool to_end = length == 0 && submessage.id != kPad && submessage.id != kInfoTimestamp;
  if (to_end) length = rest;
  submessage.body = datagram.subspan(at + kSubmessageHeader, length);
  at = std::min(datagram.size(), at + kSubmessageHeader + ((length + 3) & ~std::size_t{3}));
  return submessage;
}

/// True for the announcement of a participant. The reader is also checked, because a DDS library
/// may dispatch by the reader and not by the writer.
bool IsAnnouncement(const Submessage& submessage) {
  if (submessage.id != kData) return false;
  const RtpsFields body(submessage.body, submessage.little());
  return body.Entity(8) == kParticipantWriter &&
         (body.Entity(4) == 0U || body.Entity(4) == kParticipantReader);
}

bool IsWholeTime(const Submessage& submessage) {
  return submessage.id == kInfoTimestamp &&
         ((submessage.flags & kNoTimestamp) != 0 || submessage.body.size() == 8);
}

Result<Found> Find(View datagram) {
  Found found;
  for (std::size_t at = kRtpsHeader; at < datagram.size();) {
    const auto submessage = Next(datagram, at);
    if (!submessage) return Error{submessage.error()};
    if (submessage->id == kInfoSource)
      return Error{"an announcement on behalf of another participant"};
    if (found.data.id != 0) continue;
    if (IsWholeTime(*submessage)) found.time = *submessage;
    if (IsAnnouncement(*submessage)) found.data = *submessage;
  }
  if (found.data.id == 0) return Error{"no announcement of a participant"};
  return found;
}

/// The content of the DATA submessage. `at`: offset of the payload in the body.
struct Content {
  Parameters said;
  std::size_t at = 0;
  bool leaves = false;
};

// Layout of DATA in bytes: extra flags (2), distance to the inline QoS (2), reader (4), writer (4),
// sequence number (8), inline QoS, payload.
Result<Content> ReadContent(const Submessage& data) {
  const RtpsFields body(data.body, data.little());
  const auto number = body.SequenceNumber(12);
  if (!number) return Broken(Refusal::length);
  if (*number < 1) return Broken(Refusal::numbers);
  Content content;
  content.at = 4 + std::size_t{*body.U16(2)};
  if (content.at < 20 || content.at > body.size()) return Broken(Refusal::data);
  Parameters qos;
  if ((data.flags & kInlineQos) != 0) {
    const Refusal reason = CheckParameters(body.From(content.at), body.little(), true, qos);
    if (reason != Refusal::none) return Broken(reason);
    content.at += qos.size;
  }
  if ((data.flags & kKey) != 0 || qos.status != 0) {
    content.leaves = true;
    return content;
  }
  const View payload = body.From(content.at);
  if ((data.flags & kPayload) == 0 || payload.size() < kEncapsulation) return Broken(Refusal::data);
  const std::uint16_t kind = *ByteReader(payload).U16Be(0);
  if (kind != kParametersBig && kind != kParametersLittle) return Broken(Refusal::parameters);
  const Refusal reason = CheckParameters(payload.subspan(kEncapsulation), kind == kParametersLittle,
                                         true, content.said);
  if (reason != Refusal::none) return Broken(reason);
  content.leaves = content.said.status != 0;
  return content;
}

void Put(Bytes& to, const Submessage& submessage) {
  const std::size_t size = submessage.body.size();
  to.push_back(submessage.id);
  to.push_back(submessage.flags);
  to.push_back(static_cast<std::uint8_t>(submessage.little() ? size & 0xFF : size >> 8));
  to.push_back(static_cast<std::uint8_t>(submessage.little() ? size >> 8 : size & 0xFF));
  Append(to, submessage.body);
  // The next submessage begins at a multiple of four bytes.
  to.resize((to.size() + 3) & ~std::size_t{3});
}

Role RoleOf(View user_data) {
  for (const Role role : {Role::publishes, Role::subscribes}) {
    if (AsText(user_data) == UserDataOf(role)) return role;
  }
  return Role::any;
}

}  // namespace

std::string_view UserDataOf(Role role) {
  constexpr std::string_view kTexts[] = {"", "baudgate/publishes", "baudgate/subscribes"};
  return kTexts[static_cast<std::size_t>(role)];
}

Result<Announcement> ReadAnnouncement(View datagram, UdpAddress sender) {
  if (datagram.size() < kRtpsHeader || !AsText(datagram).starts_with("RTPS") || datagram[4] != 2) {
    return Broken(Refusal::not_rtps);
  }
  if (datagram.size() > 0xFFFF) return Broken(Refusal::length);
  const auto found = Find(datagram);
  if (!found) return Error{found.error()};
  const auto content = ReadContent(found->data);
  if (!content) return Error{content.error()};

  Announcement announcement{.participant = PrefixOf(datagram.subspan(8)), .at = {}, .datagram = {}};
  announcement.leaves = content->leaves;
  if (announcement.leaves) return announcement;
  const Parameters& said = content->said;
  if (said.participant != announcement.participant) {
    return Error{"an announcement on behalf of another participant"};
  }
  const std::span named(said.metatraffic.data(), said.metatraffic_count);
  const auto own = std::ranges::find(named, sender.address, &UdpAddress::address);
  if (own == named.end()) return Error{"an announcement that does not name its sender's address"};
  announcement.at = *own;
  announcement.role = RoleOf(said.user_data);
  if (!said.domain && own->port < kFirstPort) return Error{"an announcement without a domain"};
  announcement.domain = said.domain.value_or((own->port - kFirstPort) / kPortsOfDomain);
  announcement.lease = said.lease_at ? Duration(said.lease_seconds * 1s) + 1s : kUsualLease;

  Append(announcement.datagram, datagram.first(kRtpsHeader));
  if (found->time.id != 0) Put(announcement.datagram, found->time);
  announcement.said_at = announcement.datagram.size() + kSubmessageHeader + content->at;
  Submessage data = found->data;
  data.body = data.body.first(content->at + kEncapsulation + said.size);
  Put(announcement.datagram, data);
  return announcement;
}

namespace {

// The most parameters of a list. For comparison: Fast DDS sends about 40, Cyclone DDS 25.
constexpr std::size_t kMostParameters = 256;
// The most addresses of one participant or endpoint, of all kinds together.
constexpr std::size_t kMostLocators = 64;
static_assert(kMostLocators <= std::tuple_size_v<decltype(Parameters::groups)>);

constexpr std::uint16_t kSentinel = 0x0001;
constexpr std::uint16_t kLease = 0x0002;
constexpr std::uint16_t kTopicName = 0x0005;
constexpr std::uint16_t kTypeName = 0x0007;
constexpr std::uint16_t kDomain = 0x000F;
constexpr std::uint16_t kPartition = 0x0029;
constexpr std::uint16_t kUserData = 0x002C;
constexpr std::uint16_t kGroupData = 0x002D;
constexpr std::uint16_t kTopicData = 0x002E;
constexpr std::uint16_t kFirstLocator = 0x002F;
constexpr std::uint16_t kGroupOfEndpoint = 0x0030;
constexpr std::uint16_t kMetatrafficLocator = 0x0032;
constexpr std::uint16_t kLastLocator = 0x0033;
constexpr std::uint16_t kGroupOfParticipant = 0x0048;
constexpr std::uint16_t kParticipantGuid = 0x0050;
constexpr std::uint16_t kGroupGuid = 0x0052;
constexpr std::uint16_t kProperties = 0x0059;
constexpr std::uint16_t kEndpointGuid = 0x005A;
constexpr std::uint16_t kEntityName = 0x0062;
constexpr std::uint16_t kTypeId = 0x0069;
constexpr std::uint16_t kKeyHash = 0x0070;
constexpr std::uint16_t kStatusInfo = 0x0071;
constexpr std::uint16_t kTypeObject = 0x0072;
constexpr std::uint16_t kRepresentation = 0x0073;
constexpr std::uint16_t kTypeInformation = 0x0075;
constexpr std::uint16_t kIdentityToken = 0x1001;
constexpr std::uint16_t kPermissionsToken = 0x1002;
constexpr std::uint16_t kLastSecurity = 0x1006;

constexpr std::size_t Padded(std::size_t size) { return (size + 3) & ~std::size_t{3}; }

/// Reads strings and sequences one after the other. fits() returns false if one ends behind the
/// parameter.
class Walk {
 public:
  explicit Walk(const RtpsFields& fields) : fields_(fields) {}

  bool fits() const { return fits_; }
  std::uint32_t Number() {
    const auto number = fields_.U32(at_);
    fits_ = fits_ && number.has_value();
    at_ += 4;
    return fits_ ? *number : 0;
  }
  void Counted() {
    const std::size_t length = Number();
    fits_ = fits_ && length <= fields_.size() - at_;
    if (fits_) at_ = Padded(at_ + length);
    if (at_ > fields_.size()) at_ = fields_.size();  // the last text may lack its padding
  }
  void Sequence(int texts_each) {
    for (std::uint32_t left = Number(); fits_ && left > 0; --left) {
      for (int i = 0; i < texts_each; ++i) Counted();
    }
  }
  bool more() const { return fits_ && at_ < fields_.size(); }

 private:
  const RtpsFields& fields_;
  std::size_t at_ = 0;
  bool fits_ = true;
};

bool IsLocator(std::uint16_t id) {
  return (id >= kFirstLocator && id <= kLastLocator) || id == kGroupOfParticipant;
}

bool IsGroup(std::uint16_t id) { return id == kGroupOfEndpoint || id == kGroupOfParticipant; }

bool DescribesType(std::uint16_t id) {
  return id == kTypeId || id == kTypeObject || id == kTypeInformation;
}

/// Returns the least size of a parameter in bytes; 0: the size depends on the content, or the
/// parameter is not used.
std::size_t LeastSize(std::uint16_t id) {
  if (IsLocator(id)) return 24;
  switch (id) {
    case kLease:
      return 8;
    case kParticipantGuid:
    case kGroupGuid:
    case kEndpointGuid:
    case kKeyHash:
      return 16;
    case kDomain:
    case kStatusInfo:
      return 4;
    default:
      return 0;
  }
}

bool ContentFits(std::uint16_t id, const RtpsFields& fields) {
  Walk content(fields);
  switch (id) {
    case kTopicName:
    case kTypeName:
    case kEntityName:
    case kUserData:
    case kGroupData:
    case kTopicData:
      content.Counted();
      return content.fits();
    case kPartition:
      content.Sequence(1);
      return content.fits();
    case kProperties:
      // Example of a refused parameter: 59 00 08 00 FF FF FF FF … claims 4294967295 properties in 8
      // bytes.
      content.Sequence(2);
      return content.fits();
    case kIdentityToken:
    case kPermissionsToken:
      // Example of a refused parameter: 01 10 14 00 … 00 00 00 10 00 00 00 10 claims a token with
      // 268435456 properties, for which Fast DDS 2.9.1 allocated 1.8 GB within seconds.
      content.Counted();
      content.Sequence(2);
      if (content.more()) content.Sequence(2);
      return content.fits();
    case kRepresentation: {
      const std::size_t count = content.Number();
      return content.fits() && count <= (fields.size() - 4) / 2;
    }
    default:
      return fields.size() >= LeastSize(id);
  }
}

// Layout of a locator in bytes: kind (4), port (4), twelve zeros, IPv4 address (4): RTPS 2.3,
// 9.3.2.
void NoteMetatraffic(const RtpsFields& fields, Parameters& found) {
  constexpr std::uint32_t kUdpV4 = 1;
  constexpr std::uint32_t kLastPort = 65535;
  const std::uint32_t port = *fields.U32(4);
  if (*fields.U32(0) != kUdpV4 || port == 0 || port > kLastPort) return;
  if (found.metatraffic_count == found.metatraffic.size()) return;
  found.metatraffic[found.metatraffic_count++] = {*fields.Entity(20),
                                                  static_cast<std::uint16_t>(port)};
}

void Note(std::uint16_t id, const RtpsFields& fields, std::size_t at, Parameters& found) {
  if (id == kParticipantGuid || id == kKeyHash) {
    // The participant's GUID has priority over the key hash. A dispose message contains only the
    // key hash.
    if (id == kParticipantGuid || !found.participant) found.participant = PrefixOf(fields.From(0));
    if (id == kKeyHash && !found.endpoint) found.endpoint = GuidOf(fields.From(0));
  } else if (id == kEndpointGuid) {
    found.endpoint = GuidOf(fields.From(0));
  } else if (id == kLease) {
    found.lease_at = at;
    found.lease_seconds = *fields.U32(0);
  } else if (id == kUserData) {
    found.user_data = *fields.Slice(4, *fields.U32(0));
  } else if (id == kDomain) {
    found.domain = *fields.U32(0);
  } else if (id == kMetatrafficLocator) {
    NoteMetatraffic(fields, found);
  } else if (id == kStatusInfo) {
    // This parameter is always big-endian: its last byte contains the flags.
    found.status = (*fields.Slice(3, 1))[0];
  }
}

}  // namespace

Refusal CheckParameters(View list, bool little, bool security, Parameters& found) {
  const RtpsFields fields(list, little);
  std::size_t locators = 0;
  std::size_t at = 0;
  for (std::size_t count = 0; count < kMostParameters; ++count) {
    const auto id = fields.U16(at);
    const auto length = fields.U16(at + 2);
    if (!id || !length) return Refusal::parameters;
    at += 4;
    if (*id == kSentinel) {
      found.size = at;
      return Refusal::none;
    }
    const auto value = fields.Slice(at, *length);
    // Example of a refused parameter: 00 80 FF FF claims 65535 bytes at the end of the datagram.
    if (!value || Padded(*length) > fields.size() - at) return Refusal::parameters;
    if (!security && *id >= kIdentityToken && *id <= kLastSecurity) return Refusal::security;
    if (IsLocator(*id) && ++locators > kMostLocators) return Refusal::parameters;
    const RtpsFields content(*value, little);
    if (!ContentFits(*id, content)) return Refusal::parameters;
    Note(*id, content, at, found);
    if (IsGroup(*id)) found.groups[found.group_count++] = at - 4;
    if (DescribesType(*id)) {
      if (found.type_count == found.types.size()) return Refusal::parameters;
      found.types[found.type_count++] = at - 4;
      found.type_bytes += Padded(*length) + 4;
    }
    at += Padded(*length);
  }
  return Refusal::parameters;
}

}  // namespace baudgate::dds
