// Why a datagram does not reach the DDS library, for counters and for people. Counted by
// gateway/outputs/dds/fast/datagram_gate.h, shown by gateway/outputs/status/dds_json.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
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
  numbers,            ///< sequence numbers that cannot be
  window,             ///< sequence numbers that jump so far that counting to them takes minutes
  security,           ///< DDS Security is not used here
  participants,       ///< more participants than there is room for
  address,            ///< more participants than one address may announce
  endpoints,          ///< more readers and writers than a participant may announce
  secured,            ///< DDS Security that is cut short or lies about a length inside
  clear_text,         ///< not protected, where the governance protects all messages
  handshakes,         ///< more messages of handshakes than there is time for
};
inline constexpr std::size_t kRefusals = static_cast<std::size_t>(Refusal::handshakes) + 1;

struct RefusalWords {
  std::string_view name;   ///< "fragment", for machines
  std::string_view words;  ///< "a fragment"
  std::string_view many;   ///< "fragments", after a number
};

/// By Refusal.
inline constexpr std::array<RefusalWords, kRefusals> kRefusalWords{{
    {"none", "nothing", "nothing"},
    {"not_rtps", "not RTPS", "not RTPS"},
    {"length", "a length beyond the datagram", "lengths beyond the datagram"},
    {"fragment", "a fragment", "fragments"},
    {"vendor_submessage", "a vendor's submessage among others",
     "submessages of a vendor among others"},
    {"data", "broken DATA", "broken DATA"},
    {"parameters", "a broken parameter list", "broken parameter lists"},
    {"numbers", "impossible sequence numbers", "impossible sequence numbers"},
    {"window", "sequence numbers that jump too far", "sequence numbers that jump too far"},
    {"security", "DDS Security, which is not used here", "of DDS Security, which is not used here"},
    {"participants", "too many participants", "participants too many"},
    {"address", "too many participants of one address", "participants too many of one address"},
    {"endpoints", "too many readers and writers", "of too many readers and writers"},
    {"secured", "broken DDS Security", "of broken DDS Security"},
    {"clear_text", "clear text, which the governance forbids",
     "in clear text, which the governance forbids"},
    {"handshakes", "too many handshakes", "of handshakes too many"},
}};
static_assert(!kRefusalWords.back().many.empty(), "every reason has words");

constexpr std::string_view Words(Refusal reason) {
  return kRefusalWords[static_cast<std::size_t>(reason)].words;
}

}  // namespace baudgate::dds
