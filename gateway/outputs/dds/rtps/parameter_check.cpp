// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/rtps/parameter_check.h"

#include <tuple>

namespace baudgate::dds {
namespace {

// More of them make no sense: Fast DDS announces about 40, Cyclone DDS 25.
constexpr std::size_t kMostParameters = 256;
// Addresses of one participant or endpoint, all kinds together.
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

/// Walks through strings and sequences; `fits` turns false where one would leave the parameter.
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
  /// A length and as many bytes: a text with its NUL, or octets.
  void Counted() {
    const std::size_t length = Number();
    fits_ = fits_ && length <= fields_.size() - at_;
    if (fits_) at_ = Padded(at_ + length);
    if (at_ > fields_.size()) at_ = fields_.size();  // the last one needs no padding
  }
  void Sequence(int texts_each) {
    for (std::uint32_t left = Number(); fits_ && left > 0; --left) {
      for (int i = 0; i < texts_each; ++i) Counted();
    }
  }
  /// Whether anything stands behind what was read.
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

/// A size that does not depend on its content; 0: it does, or the parameter is not read.
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
      // 59 00 08 00 FF FF FF FF …: 4294967295 properties in 8 bytes
      content.Sequence(2);
      return content.fits();
    case kIdentityToken:
    case kPermissionsToken:
      // 01 10 14 00 … 00 00 00 10 00 00 00 10: 268435456 properties in a token took Fast DDS 2.9.1
      // 1.8 GB within seconds
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

// kind (4), port (4), twelve zeros, IPv4 address (4): RTPS 2.3, 9.3.2
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
    // The data speak for themselves; only a dispose names its participant by the key hash.
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
    // Always big-endian: its last byte holds the flags.
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
    // 00 80 FF FF: 65535 bytes, and the datagram ends
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
