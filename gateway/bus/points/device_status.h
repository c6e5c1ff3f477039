// `DeviceStatus` is the state of a device without its values: state, counters, round trips. Written
// by gateway/bus/counters/accounts.cpp, stored in gateway/bus/points/point_store.h, shown by every
// output. `FailureRuns` (runs of unanswered exchanges) and `LastHour` (the last hour in minutes)
// are parts of it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/timing.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/counted.h"
#include "gateway/bus/points/findings.h"

namespace baudgate::bus {

// `FailureRuns` keeps the latest runs of unanswered exchanges of a device between answered
// exchanges, with their times. A retry cures a single loss, but an outage hits every request while
// it lasts. An answer that is damaged or does not fit counts as neither. Bounded memory.
// "o": answered, "x": failed, ".": no exchange yet.
//
//   o x x x o o o o x x . .     runs: 3 failed after 1 answered; 2 failed after 4, not over yet
//
class FailureRuns {
 public:
  struct Run {
    std::uint32_t answered = 0;       ///< number of answered exchanges in a row before the run
    std::uint32_t failed = 0;         ///< number of failed exchanges in the run
    std::optional<Instant> before{};  ///< when the last answer before the run came
    Instant first{};                  ///< when the first failed exchange ended
    Instant last{};                   ///< when the last failed exchange ended
    std::optional<Instant> after{};   ///< when the next answer came; empty: the run is not over
  };
  static constexpr std::size_t kKept = 16;
  /// A run that ended longer ago is forgotten when kExchanges exchanges have come after it.
  static constexpr Duration kRecent = 5min;
  static constexpr std::uint32_t kExchanges = 32;

  void Add(bool answered, Instant ended) {
    answered ? OnAnswered(ended) : OnFailed(ended);
    Forget(ended);
  }

  /// Returns the runs, the oldest first.
  const std::vector<Run>& runs() const { return runs_; }
  /// Returns the number of answered exchanges since the last run.
  std::uint32_t answered() const { return answered_; }

 private:
  void OnAnswered(Instant ended) {
    if (!runs_.empty() && !runs_.back().after) runs_.back().after = ended;
    ++answered_;
    answered_at_ = ended;
  }
  void OnFailed(Instant ended) {
    if (runs_.empty() || runs_.back().after) {
      runs_.push_back({.answered = answered_, .before = answered_at_, .first = ended});
      answered_ = 0;
    }
    ++runs_.back().failed;
    runs_.back().last = ended;
  }
  void Forget(Instant now) {
    std::uint32_t behind = answered_;
    for (const Run& run : runs_) behind += run.answered + run.failed;
    while (!runs_.empty() && runs_.front().after) {
      behind -= runs_.front().answered + runs_.front().failed;
      const bool old = now - *runs_.front().after > kRecent && behind >= kExchanges;
      if (!old && runs_.size() <= kKept) return;
      runs_.erase(runs_.begin());
    }
  }

  std::vector<Run> runs_;
  std::uint32_t answered_ = 0;
  std::optional<Instant> answered_at_;
};

// The last hour of a device in minutes: how much of it was answered, and how the line time was
// used. Written by gateway/bus/counters/accounts.cpp.

struct MinuteCounts {
  std::uint32_t answered = 0;  ///< answered exchanges
  std::uint32_t failed = 0;    ///< failed exchanges
  std::uint32_t repeats = 0;   ///< failed exchanges that were repeated
  std::uint32_t missed = 0;    ///< poll periods for which there was no time
  /// Failures of a request with all its repetitions, counted when they began.
  std::uint32_t outages = 0;
  Duration up{};      ///< time in which the device answered
  Duration down{};    ///< time in which the device did not answer
  Duration served{};  ///< line time of answered exchanges
  Duration wasted{};  ///< line time of unanswered exchanges, and of the silence after all exchanges

  MinuteCounts& operator+=(const MinuteCounts& other);
};

/// Returns the part of the time in which the device answered; 1 if it was not asked.
double Availability(const MinuteCounts& tally);

template <typename Visit>
void VisitFields(const MinuteCounts*, Visit visit) {
  visit(Counted<&MinuteCounts::answered>());
  visit(Counted<&MinuteCounts::failed>());
  visit(Counted<&MinuteCounts::repeats>());
  visit(Counted<&MinuteCounts::missed>());
  visit(Counted<&MinuteCounts::outages>());
  visit(NotInJson<&MinuteCounts::up>());
  visit(NotInJson<&MinuteCounts::down>());
  visit(NotInJson<&MinuteCounts::served>());
  visit(NotInJson<&MinuteCounts::wasted>());
}

class LastHour {
 public:
  static constexpr std::size_t kMinutes = 60;

  MinuteCounts& At(Instant now);
  /// Returns the sum of the present minute and this many full minutes before it, at most kMinutes
  /// in all.
  MinuteCounts Sum(Instant now, std::size_t full_minutes = kMinutes - 1) const;
  /// Returns the counts of each minute, the present minute last.
  std::array<MinuteCounts, kMinutes> All(Instant now) const;

 private:
  struct Minute {
    std::int64_t number = -1;
    MinuteCounts tally;
  };
  std::array<Minute, kMinutes> minutes_{};
};

/// The numbers are a public contract (register 9000, DDS).
enum class DeviceState : std::uint8_t {
  never_seen = 0,
  online = 1,
  degraded = 2,  ///< answers, but not always
  offline = 3,
  disabled = 4,
};

constexpr std::string_view Name(DeviceState state) {
  constexpr std::string_view kNames[] = {"never seen", "online", "degraded", "offline", "disabled"};
  return kNames[static_cast<std::size_t>(state)];
}

/// Returns whether the device answers, always or mostly.
constexpr bool Answers(DeviceState state) {
  return state == DeviceState::online || state == DeviceState::degraded;
}

/// Round trips in buckets of a quarter of an octave, from 64 us to over a minute: bounded memory,
/// and a percentile within 19 %.
class RoundTrips {
 public:
  void Add(Duration round_trip);
  std::uint64_t count() const { return count_; }
  Duration last() const { return last_; }
  Duration mean() const;
  /// Returns the upper edge of the bucket that this share of the round trips does not exceed. 0 <
  /// share <= 1.
  Duration Percentile(double share) const;

  static constexpr std::size_t kBuckets = 84;
  const std::array<std::uint64_t, kBuckets>& buckets() const { return buckets_; }
  /// Returns the longest round trip of the bucket. The last bucket contains all longer round trips
  /// as well.
  static Duration UpperEdge(std::size_t bucket);

 private:
  static std::size_t BucketOf(Duration round_trip);

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  Duration sum_{};
  Duration last_{};
};

/// Outcomes of the latest exchanges, to judge the present condition. Probes of an absent device are
/// not included.
class RecentOutcomes {
 public:
  static constexpr std::size_t kKept = Findings::kKept;

  void Add(Outcome outcome) { outcomes_[count_++ % kKept] = outcome; }
  std::size_t size() const { return std::min(count_, kKept); }
  std::size_t Count(Outcome outcome) const {
    return static_cast<std::size_t>(std::count(
        outcomes_.begin(), outcomes_.begin() + static_cast<std::ptrdiff_t>(size()), outcome));
  }

 private:
  std::array<Outcome, kKept> outcomes_{};
  std::size_t count_ = 0;
};

/// Results of one request of the polls.
struct QueryCount {
  std::size_t first_point = 0;  ///< index in the device's points: first point of the request
  std::size_t points = 0;
  std::uint32_t in_vain = 0;  ///< number of exchanges in a row without an answer
  /// Failures in the last eight polls, one bit each. A poll with a repetition counts as failed.
  std::uint8_t failures = 0;
  std::uint32_t refused = 0;  ///< number of exchanges in a row that the device refused
  Symptom symptom = Symptom::clean;
  std::uint8_t asked = 0;  ///< see Finding::asked
};

struct WriteCounts {
  std::array<std::uint32_t, kWriteEnds> ends{};  ///< indexed by WriteEnd
  std::uint32_t not_read_back = 0;  ///< number of confirmed writes that were not read back
};

struct DeviceStatus {
  DeviceState state = DeviceState::never_seen;
  Outcome last_outcome = Outcome::none;
  std::string last_reason;  ///< reason of the last outcome that was not ok
  std::string trouble;      ///< "type 0D, the profile says 08": why no value is good, or a remark
  std::optional<Instant> last_ok;
  WallTime last_ok_wall{};
  std::uint32_t exchanges = 0;
  std::array<std::uint32_t, kOutcomeCount> outcomes{};  ///< indexed by Outcome
  std::uint32_t retries = 0;
  std::uint32_t missed = 0;  ///< poll periods skipped because the line had no time
  std::uint32_t late = 0;    ///< see LineCounters::late
  Duration lateness{};       ///< the longest time between the reply time and a late reply
  Duration patience{};       ///< extra reply time because of late replies
  /// Exchanges in a row whose replies come one or more requests late, as probes show.
  std::uint32_t behind = 0;
  std::uint32_t doubled = 0;  ///< exchanges with a second, different reply after the first
  Instant last_doubled{};
  std::uint32_t rechecks = 0;     ///< second reads before a reading counts
  std::uint32_t unconfirmed = 0;  ///< second reads with another result
  WriteCounts writes;
  /// The device sends unasked: its messages count as exchanges, damaged messages as corrupt.
  bool unasked = false;
  std::uint32_t lost_events = 0;  ///< events sent unasked that could not be saved
  config::Timing timing;
  RecentOutcomes recent;
  Findings findings;
  FailureRuns failures;
  FailureRuns spoilt;  ///< as `failures`; damaged and strange answers count as failures
  LastHour hour;
  /// The queries of the polls, in the order in which they are asked.
  std::vector<QueryCount> queries;
  bool lacks_time = false;  ///< see Conversation::LacksTime
  std::string learned;      ///< see Conversation::WhatIsLearned
  std::string missing;      ///< see Conversation::WhatIsMissing
  Duration busy{};          ///< line time of its exchanges and of the silences after them
  RoundTrips round_trips;

  std::uint32_t Count(Outcome outcome) const { return outcomes[static_cast<std::size_t>(outcome)]; }
};

template <typename Visit>
void VisitFields(const DeviceStatus*, Visit visit) {
  visit(Counted<&DeviceStatus::state>{
      .metric = "baudgate_device_state",
      .help = "1 for the state that the device is in, 0 for the others."});
  visit(Counted<&DeviceStatus::last_outcome>());
  visit(Counted<&DeviceStatus::last_reason>());
  visit(Counted<&DeviceStatus::trouble>());
  visit(Counted<&DeviceStatus::last_ok_wall>{
      .key = "last_ok",
      .metric = "baudgate_device_last_ok_timestamp_seconds",
      .help = "When the device last answered; absent: never."});
  visit(Counted<&DeviceStatus::last_ok>{.key = "age_ms"});
  visit(Counted<&DeviceStatus::exchanges>());
  visit(Counted<&DeviceStatus::outcomes>{.metric = "baudgate_exchanges_total",
                                         .help = "Exchanges with the device, by how they ended."});
  visit(Counted<&DeviceStatus::retries>{.label = "retries"});
  visit(Counted<&DeviceStatus::missed>{.label = "missed periods"});
  visit(Counted<&DeviceStatus::late>{.label = "late"});
  visit(Counted<&DeviceStatus::lateness>{.key = "lateness_ms"});
  visit(Counted<&DeviceStatus::patience>{.key = "patience_ms"});
  visit(Counted<&DeviceStatus::doubled>());
  visit(Counted<&DeviceStatus::rechecks>());
  visit(Counted<&DeviceStatus::unconfirmed>());
  visit(Counted<&DeviceStatus::unasked>());
  visit(Counted<&DeviceStatus::lost_events>());
  visit(Counted<&DeviceStatus::writes>());
  visit(Counted<&DeviceStatus::learned>());
  visit(Counted<&DeviceStatus::timing>{.key = "times"});
  visit(Counted<&DeviceStatus::recent>());
  visit(Counted<&DeviceStatus::findings>{.key = "seen"});
  visit(Counted<&DeviceStatus::hour>());
  visit(Counted<&DeviceStatus::busy>{.key = "busy_ms"});
  visit(Counted<&DeviceStatus::round_trips>());
}

}  // namespace baudgate::bus
