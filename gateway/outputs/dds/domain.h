// In which DDS domain and on which interfaces a gateway or a subscriber takes part. Comes from
// `dds:` of the configuration or from the command line, goes to
// gateway/outputs/dds/fast/participant.h. WriterId names who wrote a sample, Refusal and
// DatagramCounters tell what became of datagrams, Subscribers counts readers, and Neighbours has
// the addresses of subscribers and remarks about them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/network.h"
#include "config/model/outputs.h"
#include "gateway/base/time.h"

namespace baudgate::dds {

struct ParticipantOptions {
  std::string name = "baudgate";        ///< of the participant, for tools: that of the gateway
  int domain = 0;                       ///< 0…232
  std::vector<std::string> interfaces;  ///< addresses of this machine; empty or 0.0.0.0 = all
  std::size_t participants = 256;       ///< others in the domain; those beyond are not let in
  /// Others take us for gone after this time without a sign of life. It should not be shorter than
  /// the lease of Cyclone DDS (10 s). Otherwise Cyclone forgets us in a break of the link while we
  /// still know it, and the library does not introduce itself again.
  Duration lease = config::kUsualLease;

  bool multicast = true;
  /// IPv4 addresses that are asked beside the multicast group.
  std::vector<std::string> peers{};
  std::vector<config::HostPort> discovery_servers{};
  /// Addresses of subscribers that the process before this one has reached.
  std::vector<config::HostPort> reached{};
  config::DdsSecurity security{};
};

/// As the configuration has it.
ParticipantOptions ParticipantOf(const config::Dds& dds);

// Who wrote a sample, as RTPS names it. Comes from gateway/outputs/dds/fast, is shown by
// gateway/tools/watch.

/// A participant: one process of one gateway, whose writers may be many. Whoever reaches the domain
/// can use another's.
struct PublisherId {
  std::array<std::uint8_t, 12> bytes{};
  auto operator<=>(const PublisherId&) const = default;
};

struct WriterId {
  PublisherId publisher;
  std::array<std::uint8_t, 4> entity{};
  auto operator<=>(const WriterId&) const = default;
};

/// As Fast DDS writes them: "01.0f.0a.1b.2c.3d.00.00.01.00.00.00" and the same with "|0.0.1.2".
std::string Text(const PublisherId& id);
std::string Text(const WriterId& id);

/// Where a sample came from.
struct Origin {
  WriterId writer;
  WallTime received;
};

// Why a datagram does not reach the DDS library, for counters and for people. Counted by
// gateway/outputs/dds/fast/datagram_check.h, shown by gateway/outputs/dds/output/dds_json.h.
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

// How many datagrams the DDS library was given and how many it was spared: counted by
// gateway/outputs/dds/fast/datagram_check.h, carried by the link, shown by the status.
struct DatagramCounters {
  std::uint64_t passed = 0;
  std::array<std::uint64_t, kRefusals> refused{};  ///< by Refusal
  std::uint32_t participants = 0;                  ///< that have a place now

  bool operator==(const DatagramCounters&) const = default;
  std::uint64_t Refused(Refusal reason) const { return refused[static_cast<std::size_t>(reason)]; }
  std::uint64_t AllRefused() const {
    return std::accumulate(refused.begin(), refused.end(), std::uint64_t{0});
  }
  /// What another process has counted before; its participants are gone.
  void AddEarlier(const DatagramCounters& earlier) {
    passed += earlier.passed;
    for (std::size_t i = 0; i < kRefusals; ++i) refused[i] += earlier.refused[i];
  }
};

// What baudgate-dds tells the gateway about other participants of the domain, with its counts.

/// Readers of each topic that are connected now.
struct Subscribers {
  std::uint32_t points = 0;
  std::uint32_t devices = 0;
  std::uint32_t events = 0;
  std::uint32_t alarms = 0;

  bool operator==(const Subscribers&) const = default;
};

struct Neighbours {
  static constexpr std::size_t kMostReached = 64;
  static constexpr std::size_t kMostRemarks = 8;

  /// IPv4 addresses and ports of subscribers. The next process announces itself there at once:
  /// without multicast a subscriber would find it seconds later.
  std::vector<config::HostPort> reached;
  /// One sentence each: a subscriber that can get nothing, or what keeps all of them from it.
  std::vector<std::string> remarks;

  bool operator==(const Neighbours&) const = default;
};

}  // namespace baudgate::dds
