// The participants in the domain, as far as there is room: which announced ones the DDS library
// gets to know. Pure and of fixed size; gateway/outputs/dds/fast/datagram_check.h asks it.
// EndpointTable limits readers and writers, and SequenceWindow limits jumps of a writer's numbers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/domain.h"
#include "gateway/outputs/dds/rtps/announcement.h"
#include "gateway/outputs/dds/rtps/rtps_fields.h"

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

// How many readers and writers the participants of the domain may announce: the DDS library keeps
// each, whatever its topic. Pure and of bounded size; gateway/outputs/dds/fast/datagram_check.h
// asks it.
struct EndpointLimits {
  std::size_t of_participant = 512;
  std::size_t all = 8192;
  /// New ones of a participant, after a burst of as many as it may have.
  Duration new_interval = 10ms;
};

class EndpointTable {
 public:
  explicit EndpointTable(const EndpointLimits& limits) : limits_(limits) {}

  /// False: there is no room, or they come too fast. One of a participant that is not among
  /// `participants` passes: the library does not keep it.
  bool Announce(const Guid& endpoint, ParticipantTable& participants, Instant now);
  void Left(const Guid& endpoint);
  /// With all that it has announced.
  void ParticipantLeft(const GuidPrefix& prefix);

  std::size_t size() const;

 private:
  struct Owner {
    GuidPrefix prefix{};
    std::vector<std::uint32_t> entities;
    Instant full_at{};  ///< the bucket of new ones
  };

  Owner* Find(const GuidPrefix& prefix);

  EndpointLimits limits_;
  std::vector<Owner> owners_;
};

// How far each writer has counted, as far as it has told: the DDS library counts every number that
// is skipped one by one, so a jump has a price. Pure and of fixed size;
// gateway/outputs/dds/fast/datagram_check.h asks it.
struct WindowLimits {
  /// Numbers that all writers of discovery may skip together at once, and how many each second
  /// after that. A participant of Cyclone DDS that runs for years has told of its liveliness some
  /// million times.
  std::int64_t burst = 1 << 24;
  std::int64_t each_second = 1 << 22;
  /// What a writer of samples may begin with when it is first heard of.
  std::int64_t first_of_samples = std::int64_t{1} << 32;
};

class SequenceWindow {
 public:
  explicit SequenceWindow(const WindowLimits& limits);

  /// The writer tells of numbers up to `to`, at least 0, and of `skipped` ones that no reader gets.
  /// False: counting to there would take too long.
  bool Advance(const Guid& writer, std::int64_t to, std::int64_t skipped, Instant now);

 private:
  struct Writer {
    Guid guid{};
    std::int64_t told = 0;
    Instant heard{};
  };

  Writer& Find(const Guid& guid);
  bool Pay(std::int64_t steps, Instant now);

  WindowLimits limits_;
  std::vector<Writer> writers_;
  std::int64_t purse_;
  Instant filled_{};
};

}  // namespace baudgate::dds
