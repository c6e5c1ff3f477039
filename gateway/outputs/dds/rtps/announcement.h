// `ReadAnnouncement` reads the announcement of an RTPS participant (SPDP): its id, its DDS domain,
// and the address at which it receives announcements. The result contains a copy of the
// announcement without other submessages, which gateway/outputs/dds/discovery/announcement_relay.h
// forwards. Source: DDSI-RTPS 2.3, 8.5.3 and 9.6.2.2.
//
//   52 54 50 53 | 02 03 | 01 0F | GUID prefix (12) | 09 01 08 00 time | 15 05 … DATA of 00 01 00 C2
//
// CheckParameters checks a parameter list of RTPS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/rtps/rtps_fields.h"

namespace baudgate::dds {

struct UdpAddress {
  std::uint32_t address = 0;  ///< IPv4 address in host order
  std::uint16_t port = 0;

  bool operator==(const UdpAddress&) const = default;
};

/// Returns nothing if `host` is not an IPv4 address.
std::optional<UdpAddress> ParseUdpAddress(const std::string& host, std::uint16_t port);

std::string HostOf(const UdpAddress& at);
std::string Text(const UdpAddress& at);

/// The role of a participant, which it sends as user data. Participants that both publish or both
/// subscribe are not announced to each other, because they exchange nothing: 100 gateways would
/// cause 9,900 useless announcements.
enum class Role : std::uint8_t { any, publishes, subscribes };

std::string_view UserDataOf(Role role);

struct Announcement {
  GuidPrefix participant{};
  bool leaves = false;       ///< the participant leaves; all following members are empty
  std::uint32_t domain = 0;  ///< from the announcement; if it has none, from the participant's port
  UdpAddress at;             ///< address at which the participant receives announcements
  Role role = Role::any;     ///< `any` also for participants of other programs than baudgate
  Duration lease{};
  Bytes datagram;           ///< RTPS header, time stamp and the announcement; nothing else
  std::size_t said_at = 0;  ///< position of the announcement's payload in `datagram`

  View said() const { return View(datagram).subspan(said_at); }
};

/// Reads an announcement. `at` of the result is an address that the announcement contains and from
/// which it was sent, so a sender that cannot forge its address cannot direct datagrams to a third
/// party. The error is a sentence.
Result<Announcement> ReadAnnouncement(View datagram, UdpAddress sender);

// CheckParameters checks every length in an RTPS parameter list (inline QoS or discovery data)
// before it is used. Source: DDSI-RTPS 2.3, 9.4.2.11 and 9.6.2.2.

/// The parameters that the callers use. Offsets count from the first byte of the list.
struct Parameters {
  std::size_t size = 0;
  std::optional<GuidPrefix> participant;
  std::optional<Guid> endpoint;
  std::optional<std::size_t> lease_at;
  std::uint32_t lease_seconds = 0;
  std::optional<std::uint32_t> domain;
  View user_data;  ///< part of the list
  /// UDPv4 addresses and ports at which a participant receives announcements, 16 at most.
  std::array<UdpAddress, 16> metatraffic{};
  std::size_t metatraffic_count = 0;
  /// Offsets of the descriptions of types (XTypes), and the sum of their sizes in bytes.
  std::array<std::size_t, 8> types{};
  std::size_t type_count = 0;
  std::size_t type_bytes = 0;
  /// Offsets of the multicast addresses for samples (not for announcements).
  std::array<std::size_t, 64> groups{};
  std::size_t group_count = 0;
  /// Status of the announced entity: bit 0: disposed, bit 1: unregistered.
  std::uint32_t status = 0;
};

/// Checks the RTPS parameter list at the beginning of `list`; further bytes can follow. Fills
/// `found`. Returns why the list is refused, or `none`. `little`: the byte order is little endian.
/// `security`: parameters of DDS Security are allowed.
Refusal CheckParameters(View list, bool little, bool security, Parameters& found);

}  // namespace baudgate::dds
