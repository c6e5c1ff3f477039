// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/rtps/announcement.h"

#include <arpa/inet.h>

#include <algorithm>

#include "gateway/outputs/dds/rtps/parameter_check.h"

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
// Ports of domain D are 7400 + 250 D and up (9.6.1.1).
constexpr std::uint32_t kFirstPort = 7400;
constexpr std::uint32_t kPortsOfDomain = 250;

struct Submessage {
  std::uint8_t id = 0;
  std::uint8_t flags = 0;
  View body;

  bool little() const { return (flags & kLittleEndian) != 0; }
};

/// The two submessages that are passed on; of several announcements the first one counts.
struct Found {
  Submessage time;
  Submessage data;
};

Error Broken(Refusal reason) { return Error{std::string(Words(reason))}; }

/// The submessage at `at`, which it moves behind it.
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

/// A library may ask which reader is meant, not which writer it came from.
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
    if (submessage->id == kInfoSource) return Error{"an announcement on behalf of another"};
    if (found.data.id != 0) continue;
    if (IsWholeTime(*submessage)) found.time = *submessage;
    if (IsAnnouncement(*submessage)) found.data = *submessage;
  }
  if (found.data.id == 0) return Error{"no announcement of a participant"};
  return found;
}

/// What stands in the DATA: parameters, where they begin, and whether the participant leaves.
struct Content {
  Parameters said;
  std::size_t at = 0;
  bool leaves = false;
};

// extra flags (2), bytes to inline QoS (2), reader (4), writer (4), number (8), inline QoS, payload
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
  to.resize((to.size() + 3) & ~std::size_t{3});  // the next submessage begins at a multiple of four
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
    return Error{"an announcement on behalf of another"};
  }
  const std::span named(said.metatraffic.data(), said.metatraffic_count);
  const auto own = std::ranges::find(named, sender.address, &UdpAddress::address);
  if (own == named.end()) return Error{"an announcement without the address that it came from"};
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

}  // namespace baudgate::dds
