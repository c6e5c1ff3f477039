// The participants in the domain, as far as there is room: which announced ones the DDS library
// gets to know. Pure and of fixed size; gateway/outputs/dds/fast/datagram_check.h asks it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/refusal.h"
#include "gateway/outputs/dds/rtps/rtps_fields.h"
#include "gateway/outputs/dds/rtps/udp_address.h"

namespace baudgate::dds {

struct ParticipantLimits {
  std::size_t participants = 256;
  /// At one IPv4 address: RTPS has ports for 120 participants of a machine (RTPS 2.3, 9.6.1.1).
  std::size_t of_address = 128;
  /// A participant that is silent for this time loses its place, whatever lease it announces.
  Duration longest_lease = 60s;
  /// New participants, after a burst of as many as there is room for.
  Duration new_interval = 20ms;
  Duration new_interval_of_address = 125ms;
};

class ParticipantTable {
 public:
  explicit ParticipantTable(const ParticipantLimits& limits);

  /// Anything came from it.
  void Heard(const GuidPrefix& prefix, Instant now);
  /// It announces itself, or a discovery server does so for it.
  Refusal Announce(const GuidPrefix& prefix, std::uint32_t address, Duration lease, Instant now);
  /// Stores the address at which a known participant listens for announcements. `own`: it also
  /// sends from there. `subscribes`: it may be a subscriber.
  void Describe(const GuidPrefix& prefix, UdpAddress at, bool own, bool subscribes);
  /// A known participant has confirmed an announcement of ours.
  void Confirmed(const GuidPrefix& prefix);
  void Left(const GuidPrefix& prefix);
  bool Has(const GuidPrefix& prefix) { return Find(prefix) != nullptr; }

  std::size_t size() const { return participants_.size(); }
  /// The addresses of subscribers that have confirmed.
  std::vector<UdpAddress> Reached(Instant now) const;
  /// The addresses of subscribers that have announced themselves for kUnanswered and have confirmed
  /// nothing.
  std::vector<UdpAddress> Unanswered(Instant now) const;
  static constexpr Duration kUnanswered = 5s;
  const ParticipantLimits& limits() const { return limits_; }

 private:
  struct Participant {
    GuidPrefix prefix{};
    std::uint32_t address = 0;
    Duration lease{};
    Instant heard{};
    Instant since{};
    UdpAddress at{};
    bool own = false;
    bool subscribes = false;
    bool confirmed = false;

    bool Lives(Instant now) const { return now - heard <= lease; }
  };
  /// New participants that an address has announced: the bucket of 128 is full again then.
  struct Source {
    std::uint32_t address = 0;
    Instant full_at{};
  };

  Participant* Find(const GuidPrefix& prefix);
  void ForgetSilent(Instant now);
  Source& SourceOf(std::uint32_t address);

  ParticipantLimits limits_;
  std::vector<Participant> participants_;
  std::vector<Source> sources_;
  std::size_t last_found_ = 0;
  Instant full_at_{};
};

}  // namespace baudgate::dds
