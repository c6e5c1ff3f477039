// `ParticipantOptions` contains the DDS domain and the interfaces that a gateway or a subscriber
// uses. This header also contains the types that all parts of DDS share: WriterId, Refusal,
// DatagramCounters, Subscribers and Neighbours.
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
  std::string name = "baudgate";        ///< the gateway's name, which DDS tools show
  int domain = 0;                       ///< DDS domain, 0…232
  std::vector<std::string> interfaces;  ///< addresses of this machine; empty or 0.0.0.0: all
  /// The most other participants in the domain; further participants are refused.
  std::size_t participants = 256;
  /// The lease that we announce: a participant that receives nothing from us for this time drops
  /// us. It should not be shorter than the lease of Cyclone DDS (10 s). Otherwise, after a break of
  /// the network, Cyclone may have dropped us while our Fast DDS still knows Cyclone, and does not
  /// announce itself again.
  Duration lease = config::kUsualLease;

  bool multicast = true;
  /// IPv4 addresses of other participants, to which announcements are sent in addition to the
  /// multicast group.
  std::vector<std::string> peers{};
  std::vector<config::HostPort> discovery_servers{};
  /// Addresses of the subscribers that the previous process of this gateway had matched.
  /// Announcements are also sent to them.
  std::vector<config::HostPort> reached{};
  config::DdsSecurity security{};
};

ParticipantOptions ParticipantOf(const config::Dds& dds);

// WriterId identifies the writer of a sample in the form of RTPS; gateway/tools/watch prints it.

/// PublisherId identifies a participant: one process of one gateway, which can have many writers.
/// It is not a proof of identity, because anyone in the domain can send with the id of another
/// participant.
struct PublisherId {
  std::array<std::uint8_t, 12> bytes{};
  auto operator<=>(const PublisherId&) const = default;
};

struct WriterId {
  PublisherId publisher;
  std::array<std::uint8_t, 4> entity{};
  auto operator<=>(const WriterId&) const = default;
};

/// Text returns the notation of Fast DDS: "01.0f.0a.1b.2c.3d.00.00.01.00.00.00" for a participant;
/// for a writer, "|0.0.1.2" follows.
std::string Text(const PublisherId& id);
std::string Text(const WriterId& id);

struct Origin {
  WriterId writer;
  WallTime received;
};

// Refusal: why a datagram is not passed to the DDS library
// (gateway/outputs/dds/fast/datagram_check.h).
enum class Refusal : std::uint8_t {
  none,
  not_rtps,           ///< no RTPS 2 header
  length,             ///< a submessage is longer than the datagram, or shorter than its fields
  fragment,           ///< DATA_FRAG, HEARTBEAT_FRAG, NACK_FRAG
  vendor_submessage,  ///< a vendor's submessage with further submessages after it
  data,               ///< DATA with contradictory flags, or without room for its payload
  parameters,         ///< a parameter list that is cut short, or contains a wrong length
  numbers,            ///< a sequence number that is impossible, e.g. negative
  window,             ///< sequence numbers that jump so far that Fast DDS would count for minutes
  security,           ///< a submessage of DDS Security while DDS Security is off
  participants,       ///< a participant beyond the ParticipantLimits of the domain
  address,            ///< a participant beyond the ParticipantLimits of its IP address
  endpoints,          ///< a reader or writer beyond the EndpointLimits
  secured,            ///< DDS Security data that is cut short, or contains a wrong length
  clear_text,         ///< an unprotected message, although the governance demands protection
  handshakes,         ///< a handshake message beyond the limit of messages per time
};
inline constexpr std::size_t kRefusals = static_cast<std::size_t>(Refusal::handshakes) + 1;

struct RefusalWords {
  std::string_view name;   ///< name for machines, e.g. "fragment"
  std::string_view words;  ///< text for people, e.g. "a fragment"
  std::string_view many;   ///< text after a number, e.g. "fragments"
};

inline constexpr std::array<RefusalWords, kRefusals> kRefusalWords{{
    {"none", "nothing", "nothing"},
    {"not_rtps", "not RTPS", "not RTPS"},
    {"length", "a length beyond the datagram", "lengths beyond the datagram"},
    {"fragment", "a fragment", "fragments"},
    {"vendor_submessage", "a vendor's submessage between other submessages",
     "submessages of a vendor between other submessages"},
    {"data", "broken DATA", "broken DATA"},
    {"parameters", "a broken parameter list", "broken parameter lists"},
    {"numbers", "impossible sequence numbers", "impossible sequence numbers"},
    {"window", "sequence numbers that jump too far", "sequence numbers that jump too far"},
    {"security", "DDS Security, which is not used here",
     "with DDS Security, which is not used here"},
    {"participants", "too many participants", "participants beyond the limit"},
    {"address", "too many participants from one IP address",
     "participants beyond the limit for one IP address"},
    {"endpoints", "too many readers and writers", "with too many readers and writers"},
    {"secured", "broken DDS Security", "with broken DDS Security"},
    {"clear_text", "clear text, which the governance forbids",
     "in clear text, which the governance forbids"},
    {"handshakes", "too many handshakes", "handshakes beyond the limit"},
}};
static_assert(!kRefusalWords.back().many.empty(), "every reason has words");

constexpr std::string_view Words(Refusal reason) {
  return kRefusalWords[static_cast<std::size_t>(reason)].words;
}

struct DatagramCounters {
  std::uint64_t passed = 0;
  std::array<std::uint64_t, kRefusals> refused{};
  std::uint32_t participants = 0;  ///< other participants that are known now

  bool operator==(const DatagramCounters&) const = default;
  std::uint64_t Refused(Refusal reason) const { return refused[static_cast<std::size_t>(reason)]; }
  std::uint64_t AllRefused() const {
    return std::accumulate(refused.begin(), refused.end(), std::uint64_t{0});
  }
  /// Adds the counts of an earlier process; its `participants` are not added, because they are
  /// gone.
  void AddEarlier(const DatagramCounters& earlier) {
    passed += earlier.passed;
    for (std::size_t i = 0; i < kRefusals; ++i) refused[i] += earlier.refused[i];
  }
};

// Subscribers and Neighbours: reports of baudgate-dds to the gateway about other participants.

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

  /// IPv4 addresses and ports of subscribers. The next process of this gateway announces itself to
  /// them at once, because a subscriber without multicast would otherwise discover it only seconds
  /// later.
  std::vector<config::HostPort> reached;
  /// Sentences, each about one subscriber that can receive nothing, or about a fault that affects
  /// all subscribers.
  std::vector<std::string> remarks;

  bool operator==(const Neighbours&) const = default;
};

}  // namespace baudgate::dds
