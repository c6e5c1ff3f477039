// Parameter lists of RTPS datagrams: inline QoS and the data of discovery. Every length inside is
// looked at before anybody relies on it. Pure; gateway/outputs/dds/fast/datagram_check.h and
// gateway/outputs/dds/rtps/announcement.h call it. Source: DDSI-RTPS 2.3, 9.4.2.11 and 9.6.2.2.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/rtps/announcement.h"
#include "gateway/outputs/dds/rtps/rtps_fields.h"

namespace baudgate::dds {

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
