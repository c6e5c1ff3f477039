// The discovery server's decisions: participants that announce themselves to it are introduced to
// each other, and speak with each other from then on. Pure: datagrams and time in, datagrams out;
// memory is bounded. RelaySocket has the socket.
//
//   A announces itself to the server     → nobody is there yet
//   B announces itself to the server     → B gets A's announcement, A gets B's
//   the server is killed                 → A and B go on, as they announce themselves to each other
//   the server is there again            → it knows A and B once both have announced themselves
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

/// So many datagrams at once, and so many a second after that.
struct RelayRate {
  std::int64_t burst = 0;
  std::int64_t each_second = 0;
};

struct RelayLimits {
  std::size_t participants = 512;
  std::size_t of_address = 128;  ///< as of ParticipantLimits
  /// As long as an announcement may be. Fast DDS needs 500 bytes, with DDS Security 1,000.
  std::size_t datagram = 4096;
  /// A participant that is silent for longer is forgotten, whatever lease it announced.
  Duration longest_lease = 60s;
  /// How often all hear of one of them again; with more than 50 participants 200 ms for each.
  Duration repeat = 10s;
  Duration repeat_each = 200ms;
  RelayRate new_of_address = {128, 8};
  RelayRate rounds_of_participant = {4, 1};  ///< that all others hear of it
  RelayRate to_address = {16384, 1024};
  RelayRate to_all = {32768, 8192};
};

/// One datagram to be sent.
struct Introduction {
  UdpAddress to;
  View datagram;
};

struct Relayed {
  /// Valid until the next datagram comes.
  std::span<const Introduction> introductions;
  std::string refused;  ///< why, in words; empty: nothing was wrong
};

class AnnouncementRelay {
 public:
  explicit AnnouncementRelay(const RelayLimits& limits = {});

  Relayed On(View datagram, UdpAddress sender, Instant now);

  std::size_t participants() const { return known_.size(); }

 private:
  /// What is left of a rate.
  struct Purse {
    std::int64_t left = 0;
    Instant filled{};
    bool Take(const RelayRate& rate, Instant now);
  };
  struct Known {
    Announcement announcement;
    Instant heard{};
    int rounds = 0;  ///< that all others have heard of it, as it is now
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
  /// Why there is no place; empty: there is one, and it is taken.
  std::string Admit(Announcement announcement, UdpAddress sender, Instant now);
  bool IsDue(const Known& one, Instant now) const;
  /// To itself.
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

// The discovery server's socket: datagrams go to AnnouncementRelay, and what it answers goes out.
class RelaySocket {
 public:
  /// `at` is IPv4. The error names the address, and what is wrong with it.
  static Result<RelaySocket> Open(const config::HostPort& at);
  ~RelaySocket();
  RelaySocket(RelaySocket&& other) noexcept;
  RelaySocket& operator=(RelaySocket&&) = delete;

  /// Has something to read when a datagram has come.
  int descriptor() const { return descriptor_; }
  /// Takes what has come, a bounded number of datagrams. What is refused goes to the log, folded.
  void Take(AnnouncementRelay& relay);

 private:
  explicit RelaySocket(int descriptor) : descriptor_(descriptor) {}
  void Send(const Introduction& introduction) const;

  int descriptor_ = -1;
};

}  // namespace baudgate::dds
