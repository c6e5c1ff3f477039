// `RtpsFields` reads the fields of an RTPS submessage in its byte order. The constants are the
// numbers of RTPS: kinds of submessages, flags, entities. Source: DDSI-RTPS 2.3, chapters 8.3 and
// 9.4.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "gateway/base/bytes.h"

namespace baudgate::dds {

using GuidPrefix = std::array<std::uint8_t, 12>;
/// The global id of an entity: the participant's GuidPrefix (12 bytes) and the entity's id (4
/// bytes).
using Guid = std::array<std::uint8_t, 16>;

inline constexpr std::size_t kRtpsHeader = 20;

// Ids of submessages (9.4.5.1).
inline constexpr std::uint8_t kAckNack = 0x06;
inline constexpr std::uint8_t kHeartbeat = 0x07;
inline constexpr std::uint8_t kGap = 0x08;
inline constexpr std::uint8_t kInfoTimestamp = 0x09;
inline constexpr std::uint8_t kInfoSource = 0x0C;
inline constexpr std::uint8_t kInfoDestination = 0x0E;
inline constexpr std::uint8_t kPad = 0x01;
inline constexpr std::uint8_t kNackFragment = 0x12;
inline constexpr std::uint8_t kHeartbeatFragment = 0x13;
inline constexpr std::uint8_t kData = 0x15;
inline constexpr std::uint8_t kDataFragment = 0x16;
inline constexpr std::uint8_t kFirstSecured = 0x30;  // DDS Security 1.1, 7.3.6.2
inline constexpr std::uint8_t kLastSecured = 0x34;
inline constexpr std::uint8_t kFirstVendor = 0x80;

// Flags of a submessage (9.4.5).
inline constexpr std::uint8_t kLittleEndian = 0x01;
inline constexpr std::uint8_t kInlineQos = 0x02;
inline constexpr std::uint8_t kPayload = 0x04;
inline constexpr std::uint8_t kKey = 0x08;
inline constexpr std::uint8_t kNoTimestamp = 0x02;

// Encapsulation kinds of a payload (10.5).
inline constexpr std::uint16_t kCdrBig = 0x0000;
inline constexpr std::uint16_t kCdrLittle = 0x0001;
inline constexpr std::uint16_t kParametersBig = 0x0002;
inline constexpr std::uint16_t kParametersLittle = 0x0003;
inline constexpr std::size_t kEncapsulation = 4;

// Ids of entities (9.3.1.3).
inline constexpr std::uint32_t kParticipantWriter = 0x000100C2;
inline constexpr std::uint32_t kParticipantReader = 0x000100C7;
inline constexpr std::uint32_t kPublicationsWriter = 0x000003C2;
inline constexpr std::uint32_t kPublicationsReader = 0x000003C7;
inline constexpr std::uint32_t kSubscriptionsWriter = 0x000004C2;
inline constexpr std::uint32_t kSubscriptionsReader = 0x000004C7;
inline constexpr std::uint32_t kLivelinessWriter = 0x000200C2;
inline constexpr std::uint32_t kLivelinessReader = 0x000200C7;
inline constexpr std::uint32_t kHandshakeWriter = 0x000201C3;  // DDS Security 1.1, 7.4.5
inline constexpr std::uint32_t kHandshakeReader = 0x000201C4;

/// Reads numbers from a submessage or an encapsulated list. A number beyond the end is returned as
/// empty.
class RtpsFields {
 public:
  RtpsFields(View bytes, bool little) : reader_(bytes), bytes_(bytes), little_(little) {}

  std::size_t size() const { return bytes_.size(); }
  bool little() const { return little_; }
  std::optional<std::uint16_t> U16(std::size_t at) const {
    return little_ ? reader_.U16Le(at) : reader_.U16Be(at);
  }
  std::optional<std::uint32_t> U32(std::size_t at) const {
    return little_ ? reader_.U32Le(at) : reader_.U32Be(at);
  }
  /// Entity ids are always big-endian, also in a little-endian submessage.
  std::optional<std::uint32_t> Entity(std::size_t at) const { return reader_.U32Be(at); }
  std::optional<std::int64_t> SequenceNumber(std::size_t at) const {
    const auto high = U32(at);
    const auto low = U32(at + 4);
    if (!high || !low) return std::nullopt;
    return static_cast<std::int64_t>(std::uint64_t{*high} << 32 | *low);
  }
  std::optional<View> Slice(std::size_t at, std::size_t count) const {
    return reader_.Slice(at, count);
  }
  View From(std::size_t at) const { return bytes_.subspan(std::min(at, bytes_.size())); }

 private:
  ByteReader reader_;
  View bytes_;
  bool little_;
};

inline GuidPrefix PrefixOf(View bytes) {
  GuidPrefix prefix{};
  std::memcpy(prefix.data(), bytes.data(), std::min(bytes.size(), prefix.size()));
  return prefix;
}

inline Guid GuidOf(View bytes) {
  Guid guid{};
  std::memcpy(guid.data(), bytes.data(), std::min(bytes.size(), guid.size()));
  return guid;
}

}  // namespace baudgate::dds
