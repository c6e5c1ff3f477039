// `DeviceStatus` is the state of a device without its values: state, counters, round trips.
// gateway/bus/counters/accounts.cpp writes it, the point store contains it, every output shows it.
// Its parts are defined here too: `FailureRuns` (unanswered exchanges in a row), `LastHour` (counts
// of each minute of the last hour), `RoundTrips`, `RecentOutcomes`, `QueryCount` and `WriteCounts`.
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

// `FailureRuns` stores the latest runs of a device. A run is a number of unanswered exchanges
// between two answered exchanges. Runs separate single losses, which a retry cures, from outages,
// in which each request fails. Memory is bounded. The caller decides what counts as answered.
// Example, with "o": answered, "x": failed, ".": no exchange yet:
//
//   o x x x o o o o x x . .     runs: 3 failed after 1 answered; 2 failed after 4, not over yet
//
class FailureRuns {
 public:
  struct Run {
    std::uint32_t answered = 0;  ///< number of answered exchanges in a row before the run
    std::uint32_t failed = 0;
    std::optional<Instant> before{};  ///< when the last answer before the run came
    Instant first{};
    Instant last{};
    std::optional<Instant> after{};  ///< when the next answer came; empty: the run has not ended
  };
  static constexpr std::size_t kKept = 16;
  /// A run is removed if it ended longer ago than kRecent and at least kExchanges exchanges came
  /// after it, or if there are more than kKept runs.
  static constexpr Duration kRecent = 5min;
  static constexpr std::uint32_t kExchanges = 32;

  void Add(bool answered, Instant ended) {
    answered ? OnAnswered(ended) : OnFailed(ended);
    Forget(ended);
  }

  /// Returns the runs; the oldest is the first.
  const std::vector<Run>& runs() const { return runs_; }
  /// Returns the number of answered exchanges since the last run ended.
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

// `MinuteCounts` contains counts of a device in one minute: how many exchanges were answered, and
// how the line time was used. `LastHour` contains the latest 60 of them.

struct MinuteCounts {
  std::uint32_t answered = 0;
  std::uint32_t failed = 0;
  std::uint32_t repeats = 0;  ///< failed exchanges after which the request was sent again
  std::uint32_t missed = 0;   ///< poll periods that were skipped because the line had no time
  /// Number of outages that began. An outage is a failed request with all its retries failed.
  std::uint32_t outages = 0;
  Duration up{};      ///< time from one exchange to the next, if the next was answered
  Duration down{};    ///< time from one exchange to the next, if the next failed
  Duration served{};  ///< line time of answered exchanges
  Duration wasted{};  ///< line time of failed exchanges, and of the silences after all exchanges

  MinuteCounts& operator+=(const MinuteCounts& other);
};

/// Returns the part of the time in which the device answered, 0 to 1. If it was not asked: 1.
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
  /// Returns the sum of the present minute and of `full_minutes` minutes before it; at most 59
  /// minutes before it are stored.
  MinuteCounts Sum(Instant now, std::size_t full_minutes = kMinutes - 1) const;
  /// Returns the counts of each minute. The present minute is the last.
  std::array<MinuteCounts, kMinutes> All(Instant now) const;

 private:
  struct Minute {
    std::int64_t number = -1;
    MinuteCounts tally;
  };
  std::array<Minute, kMinutes> minutes_{};
};

/// State of a device. The numbers are a public contract (register 9000, DDS).
enum class DeviceState : std::uint8_t {
  never_seen = 0,
  online = 1,
  degraded = 2,  ///< some of its exchanges fail
  offline = 3,
  disabled = 4,
};

constexpr std::string_view Name(DeviceState state) {
  constexpr std::string_view kNames[] = {"never seen", "online", "degraded", "offline", "disabled"};
  return kNames[static_cast<std::size_t>(state)];
}

/// True if the device answers all or most requests.
constexpr bool Answers(DeviceState state) {
  return state == DeviceState::online || state == DeviceState::degraded;
}

/// Histogram of round trips, 64 us to over a minute. Each bucket ends 19 % (a quarter of an octave)
/// above the previous one, so a percentile is exact to 19 %. Memory is bounded.
class RoundTrips {
 public:
  void Add(Duration round_trip);
  std::uint64_t count() const { return count_; }
  Duration last() const { return last_; }
  Duration mean() const;
  /// Returns a time that the part `share` of the round trips does not exceed, rounded up to the end
  /// of a bucket. Example: 0.95 for 95 % of the round trips. 0 < share <= 1.
  Duration Percentile(double share) const;

  static constexpr std::size_t kBuckets = 84;
  const std::array<std::uint64_t, kBuckets>& buckets() const { return buckets_; }
  /// Returns the longest round trip that the bucket contains. The last bucket also contains all
  /// longer round trips.
  static Duration UpperEdge(std::size_t bucket);

 private:
  static std::size_t BucketOf(Duration round_trip);

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  Duration sum_{};
  Duration last_{};
};

/// Outcomes of the latest kKept exchanges of a device. Probes of an offline device are not
/// included.
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

/// Counts of one query (protocols::Query: points that one poll reads together) of a device.
struct QueryCount {
  std::size_t first_point = 0;  ///< index of the query's first point among the points of the device
  std::size_t points = 0;
  std::uint32_t in_vain = 0;  ///< unanswered exchanges in a row
  /// The last eight polls of the query, one bit each; 1: the poll failed or needed a retry.
  std::uint8_t failures = 0;
  std::uint32_t refused = 0;  ///< refused exchanges in a row
  Symptom symptom = Symptom::clean;
  std::uint8_t asked = 0;  ///< which of kSpecialBytes the request contains, one bit each
};

struct WriteCounts {
  std::array<std::uint32_t, kWriteEnds> ends{};
  std::uint32_t not_read_back = 0;  ///< number of confirmed writes that were not read back
};

struct DeviceStatus {
  DeviceState state = DeviceState::never_seen;
  Outcome last_outcome = Outcome::none;
  std::string last_reason;  ///< reason of the last outcome that was not ok
  /// Why no value of the device is good, such as "type 0D, the profile has 08"; or a remark of the
  /// conversation about a device whose values are good.
  std::string trouble;
  /// The client that has disabled the device. Empty: the configuration has, or a reload has
  /// continued the state, or the device is in use.
  std::string disabled_by{};
  WallTime disabled_since{};  ///< when the device was last taken out of use, or into use again
  std::optional<Instant> last_ok;
  WallTime last_ok_wall{};
  std::uint32_t exchanges = 0;
  std::array<std::uint32_t, kOutcomeCount> outcomes{};
  std::uint32_t retries = 0;
  std::uint32_t missed = 0;  ///< poll periods skipped because the line had no time
  std::uint32_t late = 0;    ///< late replies: see LineCounters::late
  Duration lateness{};       ///< the longest time by which a late reply exceeded the reply time
  Duration patience{};       ///< by how much late replies have lengthened the reply time (Patience)
  /// Number of exchanges in a row since a probe has shown that replies come one or more requests
  /// late.
  std::uint32_t behind = 0;
  std::uint32_t doubled = 0;  ///< exchanges with two different replies
  Instant last_doubled{};
  std::uint32_t rechecks = 0;     ///< readings that were read again because they had jumped
  std::uint32_t unconfirmed = 0;  ///< readings whose second reading did not confirm the jump
  WriteCounts writes;
  /// The device sends messages without being asked. Each message counts as an exchange, a damaged
  /// message as corrupt.
  bool unasked = false;
  std::uint32_t lost_events = 0;  ///< events that came without a request and could not be saved
  config::Timing timing;
  RecentOutcomes recent;
  Findings findings;
  FailureRuns failures;
  FailureRuns spoilt;  ///< like `failures`, but damaged and unexpected answers count as failures
  LastHour hour;
  /// The queries of the polls, in the order in which they are asked.
  std::vector<QueryCount> queries;
  /// The device's clock cannot be set, because the clock of this machine is wrong.
  bool lacks_time = false;
  /// Rules for requests that the conversation has learned, in words; or empty.
  std::string learned;
  /// Items that points need but that the device never sends, with a remedy; or empty.
  std::string missing;
  Duration busy{};  ///< line time of the device's exchanges and of the silences after them
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
      .help = "When the device last answered; absent if it never answered."});
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
