// Why a datagram does not reach the DDS library, for counters and for people.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace baudgate::dds {

enum class Refusal : std::uint8_t {
  none,
  not_rtps,           ///< no RTPS 2 header
  length,             ///< a submessage is longer than the datagram, or shorter than its fields
  fragment,           ///< DATA_FRAG, HEARTBEAT_FRAG, NACK_FRAG
  vendor_submessage,  ///< one that the library would read, before others
  data,               ///< DATA whose flags contradict each other, or without room for its payload
  parameters,         ///< a parameter list that is cut short or lies about a length inside
  numbers,            ///< sequence numbers that can not be
  window,             ///< sequence numbers that jump so far that counting to them takes minutes
  security,           ///< DDS Security is not used here
  participants,       ///< more participants than there is room for
  address,            ///< more participants than one address may announce
};
inline constexpr std::size_t kRefusals = static_cast<std::size_t>(Refusal::address) + 1;

/// "a fragment", for log lines and the status.
std::string_view Words(Refusal reason);

}  // namespace baudgate::dds
