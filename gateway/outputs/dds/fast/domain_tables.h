// `ParticipantTable` decides which announced participants the DDS library may store. EndpointTable
// limits a participant's readers and writers, and SequenceWindow limits jumps in a writer's
// sequence numbers. No I/O, bounded memory; gateway/outputs/dds/fast/datagram_check.h calls them.
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
  /// The most participants at one IPv4 address: RTPS has ports for 120 participants on one machine
  /// (RTPS 2.3, 9.6.1.1).
  std::size_t of_address = 128;
  /// A participant that is silent for this time is removed, even if its lease is longer.
  Duration longest_lease = 60s;
  /// New participants are limited to a burst of `participants`, then one per `new_interval`; at one
  /// address, to a burst of `of_address`, then one per `new_interval_of_address`.
  Duration new_interval = 20ms;
  Duration new_interval_of_address = 125ms;
};

class ParticipantTable {
 public:
  explicit ParticipantTable(const ParticipantLimits& limits);

  void Heard(const GuidPrefix& prefix, Instant now);
  /// To be called when the participant or a discovery server announces it. Returns why the
  /// participant is refused, or `none`.
  Refusal Announce(const GuidPrefix& prefix, std::uint32_t address, Duration lease, Instant now);
  /// Describes a known participant. `at`: the address at which it receives announcements. `own`:
  /// the announcement came from the participant itself, not from a server. `subscribes`: it may be
  /// a subscriber.
  void Describe(const GuidPrefix& prefix, UdpAddress at, bool own, bool subscribes);
  /// To be called when the participant has acknowledged our announcement of a writer.
  void Confirmed(const GuidPrefix& prefix);
  void Left(const GuidPrefix& prefix);
  bool Has(const GuidPrefix& prefix) { return Find(prefix) != nullptr; }

  std::size_t size() const { return participants_.size(); }
  /// Returns the addresses of the subscribers that announce themselves and have acknowledged our
  /// announcements.
  std::vector<UdpAddress> Reached(Instant now) const;
  /// Returns the addresses of the subscribers that are known since kUnanswered or longer and have
  /// acknowledged nothing.
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
  /// The rate limit of new participants at one address: at `full_at` a whole burst is allowed
  /// again.
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

// Limits of other participants' readers and writers, because the DDS library stores every endpoint,
// whatever its topic.
struct EndpointLimits {
  std::size_t of_participant = 512;
  std::size_t all = 8192;
  /// New endpoints of a participant are limited to a burst of `of_participant`, then one per
  /// `new_interval`.
  Duration new_interval = 10ms;
};

class EndpointTable {
 public:
  explicit EndpointTable(const EndpointLimits& limits) : limits_(limits) {}

  /// Adds an endpoint. False: a limit is reached, or endpoints are added too fast. An endpoint of a
  /// participant that is not in `participants` is not added, and the result is true, because the
  /// library does not store it.
  bool Announce(const Guid& endpoint, ParticipantTable& participants, Instant now);
  void Left(const Guid& endpoint);
  void ParticipantLeft(const GuidPrefix& prefix);

  std::size_t size() const;

 private:
  struct Owner {
    GuidPrefix prefix{};
    std::vector<std::uint32_t> entities;
    Instant full_at{};  ///< time when a whole burst of endpoints is allowed again
  };

  Owner* Find(const GuidPrefix& prefix);

  EndpointLimits limits_;
  std::vector<Owner> owners_;
};

// Limits of jumps in sequence numbers, because the DDS library counts skipped numbers one by one.
struct WindowLimits {
  /// All writers together may advance by `burst` numbers at once, and by `each_second` numbers per
  /// second after that. The first number of a writer of samples is not counted. For comparison: the
  /// liveliness writer of a Cyclone DDS participant reaches about a million in years.
  std::int64_t burst = 1 << 24;
  std::int64_t each_second = 1 << 22;
  /// The highest number that is accepted as the first number of a writer of samples.
  std::int64_t first_of_samples = std::int64_t{1} << 32;
};

class SequenceWindow {
 public:
  explicit SequenceWindow(const WindowLimits& limits);

  /// To be called when `writer` has announced numbers up to `to` (0 or more) and has marked
  /// `skipped` numbers as never sent. False: the library would count too long.
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
