// What the gateway knows of a device apart from its values: state, counters, round trips.
// Written by gateway/bus/poller/poller.cpp, held by gateway/bus/points/point_store.h, shown by
// every output.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/timing.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/write_result.h"
#include "gateway/bus/points/failure_runs.h"
#include "gateway/bus/points/findings.h"
#include "gateway/bus/points/last_hour.h"

namespace baudgate {

/// The numbers are a public contract (register 9000, DDS).
enum class DeviceState : std::uint8_t {
  never_seen = 0,
  online = 1,
  degraded = 2,  ///< answers, but not every time
  offline = 3,
  disabled = 4,
};

constexpr std::string_view Name(DeviceState state) {
  constexpr std::string_view kNames[] = {"never seen", "online", "degraded", "offline", "disabled"};
  return kNames[static_cast<std::size_t>(state)];
}

/// Always or mostly.
constexpr bool Answers(DeviceState state) {
  return state == DeviceState::online || state == DeviceState::degraded;
}

/// Round trips in buckets a quarter of an octave wide from 64 us to over a minute: bounded memory,
/// and a percentile within 19 %.
class RoundTrips {
 public:
  void Add(Duration round_trip);
  std::uint64_t count() const { return count_; }
  Duration last() const { return last_; }
  Duration mean() const;
  /// 0 < share <= 1; the upper edge of the bucket in which that share of round trips has ended.
  Duration Percentile(double share) const;

  static constexpr std::size_t kBuckets = 84;
  /// How many round trips fell into each bucket.
  const std::array<std::uint64_t, kBuckets>& buckets() const { return buckets_; }
  /// The longest round trip that belongs into the bucket; the last bucket takes all longer ones
  /// too.
  static Duration UpperEdge(std::size_t bucket);

 private:
  static std::size_t BucketOf(Duration round_trip);

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  Duration sum_{};
  Duration last_{};
};

/// How the latest exchanges ended, for a judgement of how things are now. Probes of an absent
/// device are not among them.
class RecentOutcomes {
 public:
  static constexpr std::size_t kKept = Findings::kKept;

  void Add(Outcome outcome) { outcomes_[count_++ % kKept] = outcome; }
  /// How many exchanges are kept, at most kKept.
  std::size_t size() const { return std::min(count_, kKept); }
  std::size_t Count(Outcome outcome) const {
    return static_cast<std::size_t>(std::count(
        outcomes_.begin(), outcomes_.begin() + static_cast<std::ptrdiff_t>(size()), outcome));
  }

 private:
  std::array<Outcome, kKept> outcomes_{};
  std::size_t count_ = 0;
};

/// How one request of the polls fares.
struct QueryCount {
  std::size_t first_point = 0;  ///< index in the device's points; of those that it reads
  std::size_t points = 0;
  std::uint32_t in_vain = 0;         ///< exchanges in a row without an answer
  std::uint8_t failures = 0;         ///< of the last eight polls, one bit each; repeats count too
  std::uint32_t refused = 0;         ///< exchanges in a row that the device refused
  Symptom symptom = Symptom::clean;  ///< of the last exchange
  std::uint8_t asked = 0;            ///< as Finding::asked
};

struct DeviceStatus {
  DeviceState state = DeviceState::never_seen;
  Outcome last_outcome = Outcome::none;
  std::string last_reason;  ///< of the last outcome that was not ok
  std::string trouble;      ///< "type 0D, the profile says 08": why no value is good, or a remark
  std::optional<Instant> last_ok;
  WallTime last_ok_wall{};
  std::uint32_t exchanges = 0;
  std::array<std::uint32_t, kOutcomeCount> outcomes{};  ///< indexed by Outcome
  std::uint32_t retries = 0;
  std::uint32_t missed = 0;  ///< poll periods skipped because the line had no time
  std::uint32_t late = 0;    ///< as LineCounters::late
  Duration lateness{};       ///< the largest, since the reply was due
  Duration patience{};       ///< extra reply time because of late replies
  /// Exchanges in a row whose replies come one or more requests late, as probes show.
  std::uint32_t behind = 0;
  std::uint32_t doubled = 0;  ///< exchanges after whose reply came another, different one
  Instant last_doubled{};
  std::uint32_t rechecks = 0;                      ///< second reads, before a reading counts
  std::uint32_t unconfirmed = 0;                   ///< of these, with another result
  std::array<std::uint32_t, kWriteEnds> writes{};  ///< of points, indexed by WriteEnd
  std::uint32_t unread_writes = 0;                 ///< confirmed, but not read back
  /// It sends unasked: its messages count as exchanges, damaged ones as corrupt.
  bool unasked = false;
  std::uint32_t lost_events = 0;  ///< sent unasked while they could not be saved
  config::Timing timing;          ///< the times in force
  RecentOutcomes recent;
  Findings findings;
  FailureRuns failures;
  FailureRuns spoilt;  ///< the same, with damaged and strange answers among the failures
  LastHour hour;
  std::vector<QueryCount> queries;  ///< of the polls, in the order in which they are asked
  bool lacks_time = false;          ///< see Conversation::LacksTime
  std::string learned;              ///< see Conversation::WhatIsLearned
  std::string missing;              ///< see Conversation::WhatIsMissing
  Duration busy{};  ///< the line time of its exchanges and of the silences after them
  RoundTrips round_trips;

  std::uint32_t Count(Outcome outcome) const { return outcomes[static_cast<std::size_t>(outcome)]; }
};

}  // namespace baudgate
