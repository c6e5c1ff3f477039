// Parameter lists of RTPS datagrams: inline QoS and the data of discovery. Every length inside is
// looked at before the DDS library relies on it. Pure; gateway/dds/fast/datagram_check.h calls it.
// Source: DDSI-RTPS 2.3, 9.4.2.11 and 9.6.2.2.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "gateway/dds/fast/rtps_fields.h"
#include "gateway/dds/refusal.h"

namespace baudgate::dds {

/// What a list says that others have to know; offsets count from the list's first byte.
struct Parameters {
  std::size_t size = 0;  ///< with the sentinel
  std::optional<GuidPrefix> participant;
  std::optional<Guid> endpoint;
  std::optional<std::size_t> lease_at;
  std::uint32_t lease_seconds = 0;
  /// Where descriptions of types (XTypes) begin, and how long they are together.
  std::array<std::size_t, 8> types{};
  std::size_t type_count = 0;
  std::size_t type_bytes = 0;
  std::uint32_t status = 0;  ///< bit 0: disposed, bit 1: unregistered
};

/// `list` may go on behind the list's sentinel. `security`: parameters of DDS Security are allowed.
Refusal CheckParameters(View list, bool little, bool security, Parameters& found);

}  // namespace baudgate::dds
