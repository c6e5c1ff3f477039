// `AnnouncementRelay` is the logic of the discovery server: it forwards the announcement of each
// participant to the other participants, which then talk to each other directly. No I/O: datagrams
// and the time are arguments. The memory is bounded. RelaySocket contains the socket.
//
//   A announces itself to the server   → nothing is sent, as the server has no other participant
//   B announces itself to the server   → the server sends A's announcement to B, and B's to A
//   the server is killed               → A and B go on, as they announce themselves to each other
//   the server is restarted            → it has A and B in its table after both announced again
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "config/model/network.h"
#include "gateway/base/result.h"
#include "gateway/outputs/dds/rtps/announcement.h"

namespace baudgate::dds {

/// A rate limit: at most `burst` datagrams at once, after that `each_second` datagrams per second.
struct RelayRate {
  std::int64_t burst = 0;
  std::int64_t each_second = 0;
};

struct RelayLimits {
  std::size_t participants = 512;
  std::size_t of_address = 128;  ///< participants of one address (ParticipantLimits::of_address)
  /// The longest announcement in bytes. Fast DDS sends 500 bytes, with DDS Security 1,000.
  std::size_t datagram = 4096;
  /// A participant that is silent for this time is removed, even if its lease is longer.
  Duration longest_lease = 60s;
  /// A participant's announcement is sent again to all others once in this time, or in
  /// `repeat_each` times the number of participants if that is longer.
  Duration repeat = 10s;
  Duration repeat_each = 200ms;
  RelayRate new_of_address = {128, 8};
  /// A round is one sending of a participant's announcement to all others.
  RelayRate rounds_of_participant = {4, 1};
  RelayRate to_address = {16384, 1024};
  RelayRate to_all = {32768, 8192};
};

struct Introduction {
  UdpAddress to;
  View datagram;
};

struct Relayed {
  /// The datagrams to send; valid until the next call of On.
  std::span<const Introduction> introductions;
  std::string refused;  ///< why the datagram was refused; empty: the datagram was accepted
};

class AnnouncementRelay {
 public:
  explicit AnnouncementRelay(const RelayLimits& limits = {});

  Relayed On(View datagram, UdpAddress sender, Instant now);

  std::size_t participants() const { return known_.size(); }

 private:
  /// A token bucket: the datagrams that a RelayRate still allows.
  struct Purse {
    std::int64_t left = 0;
    Instant filled{};
    bool Take(const RelayRate& rate, Instant now);
  };
  struct Known {
    Announcement announcement;
    Instant heard{};
    /// How often the announcement was sent to all others since it changed; counted up to
    /// kFirstRounds.
    int rounds = 0;
    Instant last_round{};
    Purse purse;
  };
  struct Address {
    std::uint32_t address = 0;
    Purse newcomers;
    Purse sent;
    Instant used{};
  };

  void ForgetSilent(Instant now);
  Known* Find(const GuidPrefix& participant);
  /// Adds a participant. Returns the reason if the participant is refused; empty: the participant
  /// was added.
  std::string Admit(Announcement announcement, UdpAddress sender, Instant now);
  bool IsDue(const Known& one, Instant now) const;
  void IntroduceOthersTo(const Known& newcomer, Instant now);
  void IntroduceToOthers(Known& one, Instant now);
  void Introduce(const Known& whom, const Known& to, Instant now);
  Address& AddressOf(std::uint32_t address, Instant now);

  RelayLimits limits_;
  std::vector<Known> known_;
  std::vector<Address> addresses_;
  std::vector<Introduction> introductions_;
  Purse sent_;
};

// The discovery server's UDP socket: passes received datagrams to AnnouncementRelay and sends the
// datagrams that it returns.
class RelaySocket {
 public:
  /// `at` is an IPv4 address. The error contains the address and the reason.
  static Result<RelaySocket> Open(const config::HostPort& at);
  ~RelaySocket();
  RelaySocket(RelaySocket&& other) noexcept;
  RelaySocket& operator=(RelaySocket&&) = delete;

  int descriptor() const { return descriptor_; }
  /// Reads at most 256 datagrams. Refused datagrams are logged; repeated log lines are folded into
  /// one.
  void Take(AnnouncementRelay& relay);

 private:
  explicit RelaySocket(int descriptor) : descriptor_(descriptor) {}
  void Send(const Introduction& introduction) const;

  int descriptor_ = -1;
};

}  // namespace baudgate::dds
