// How a participant announces itself (SPDP): who it is, in which domain, where it wants to hear of
// others. Read from one datagram, and made again with nothing else in it. Pure;
// gateway/outputs/dds/discovery/announcement_relay.h passes it on. Source: DDSI-RTPS 2.3, 8.5.3
// and 9.6.2.2.
//
//   52 54 50 53 | 02 03 | 01 0F | GUID prefix (12) | 09 01 08 00 time | 15 05 … DATA of 00 01 00 C2
//
// CheckParameters judges a parameter list, and UdpAddress is where a datagram comes from or goes
// to.
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

// Where a datagram comes from or goes to.
struct UdpAddress {
  std::uint32_t address = 0;  ///< IPv4, host order
  std::uint16_t port = 0;

  bool operator==(const UdpAddress&) const = default;
};

/// Empty: `host` is no IPv4 address.
std::optional<UdpAddress> ParseUdpAddress(const std::string& host, std::uint16_t port);

/// "10.0.0.7".
std::string HostOf(const UdpAddress& at);
/// "10.0.0.7:7410".
std::string Text(const UdpAddress& at);

/// What a participant of ours says of itself, as its user data: those of one role have nothing to
/// say to each other, so that 100 gateways are not introduced 9,900 times.
enum class Role : std::uint8_t { any, publishes, subscribes };

/// By Role; empty for any.
std::string_view UserDataOf(Role role);

struct Announcement {
  GuidPrefix participant{};
  bool leaves = false;       ///< it says that it is gone; what follows is empty then
  std::uint32_t domain = 0;  ///< as it says; if it does not, as its port does
  UdpAddress at;             ///< where it hears of others
  Role role = Role::any;     ///< that of any participant that is not ours
  Duration lease{};
  Bytes datagram;  ///< header, time stamp and the announcement; nothing else that was there
  std::size_t said_at = 0;  ///< from here on `datagram` is what the participant says of itself

  View said() const { return View(datagram).subspan(said_at); }
};

/// An address counts only if the announcement names it and was sent from it. So a sender
/// that cannot forge its address cannot direct others to a third party. The error says in words
/// what is wrong.
Result<Announcement> ReadAnnouncement(View datagram, UdpAddress sender);

// Parameter lists of RTPS datagrams: inline QoS and the data of discovery. Every length inside is
// looked at before anybody relies on it. Pure; gateway/outputs/dds/fast/datagram_check.h
// calls it, too. Source: DDSI-RTPS 2.3, 9.4.2.11 and 9.6.2.2.

/// What a list says that others have to know; offsets count from the list's first byte.
struct Parameters {
  std::size_t size = 0;  ///< with the sentinel
  std::optional<GuidPrefix> participant;
  std::optional<Guid> endpoint;
  std::optional<std::size_t> lease_at;
  std::uint32_t lease_seconds = 0;
  std::optional<std::uint32_t> domain;
  View user_data;  ///< within the list
  /// UDPv4 addresses and ports at which a participant hears of others; further ones are left out.
  std::array<UdpAddress, 16> metatraffic{};
  std::size_t metatraffic_count = 0;
  /// Where descriptions of types (XTypes) begin, and how long they are together.
  std::array<std::size_t, 8> types{};
  std::size_t type_count = 0;
  std::size_t type_bytes = 0;
  /// Where the multicast addresses for samples (not for announcements) begin.
  std::array<std::size_t, 64> groups{};
  std::size_t group_count = 0;
  std::uint32_t status = 0;  ///< bit 0: disposed, bit 1: unregistered
};

/// `list` may go on behind the list's sentinel. `security`: parameters of DDS Security are allowed.
Refusal CheckParameters(View list, bool little, bool security, Parameters& found);

}  // namespace baudgate::dds
