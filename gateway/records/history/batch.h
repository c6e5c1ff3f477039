// `Batch` is what the recorder passes to the files: value changes (entries), means over time spans
// that have ended (trends), and the runs that they belong to.
//
// A run is a period in which the history lacks no entry. A new run begins when the gateway starts,
// after values were dropped, when the clock of the machine was set, and after a standstill of the
// process. The time between two runs is a gap. Within a run the times of a point increase. The
// numbers of runs always increase, whatever the clock shows.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate::history {

// `Entry` is one record in the history of a point: from `time` on, the point had this value and
// quality.

/// Milliseconds since 1970, UTC: the unit of all times in the history.
using Millis = std::int64_t;

inline Millis ToMillis(WallTime time) {
  return std::chrono::floor<std::chrono::milliseconds>(time).time_since_epoch().count();
}
inline WallTime ToWall(Millis time) { return WallTime(std::chrono::milliseconds(time)); }

inline constexpr Millis kSecond = 1000;
inline constexpr Millis kMinute = 60 * kSecond;
inline constexpr Millis kHour = 60 * kMinute;
inline constexpr Millis kDay = 24 * kHour;

/// Returns the beginning of the span of `width` ms that contains `time`. Spans are aligned to 1970.
constexpr Millis FloorTo(Millis time, Millis width) {
  const Millis rest = time % width;
  return time - (rest < 0 ? rest + width : rest);
}

struct Entry {
  Millis time = 0;
  Value value{};  ///< empty: the quality is bad, or the value is not a number
  Quality quality = Quality::bad_waiting;

  bool operator==(const Entry&) const = default;
};

// `Trend` contains mean and bounds of one point over a time span of fixed width (a minute, an
// hour), aligned to 1970. It is computed from every reading, also from readings that are not
// stored. A value is valid from its reading until the next reading; the mean is over the time in
// which the value was good.
//
//   width 60 s, readings at 0 s: 10, at 30 s: 20, at 90 s: bad
//     span from 0 s:  mean 15, min 10, max 20, first 10, last 20, count 2, good 60 s
//     span from 60 s: mean 20, min 20, max 20, first 20, last 20, count 0, good 30 s
struct Trend {
  Millis begin = 0;
  double mean = 0;
  double min = 0;
  double max = 0;
  double first = 0;  ///< the first good value in the span; can have been read before the span
  double last = 0;
  std::int64_t count = 0;
  Millis good = 0;  ///< time with good quality, in ms; in a finished trend never 0

  bool operator==(const Trend&) const = default;
};

/// Merges two parts of the same span. `later` directly follows `trend`, which receives the result.
void Merge(Trend& trend, const Trend& later);

/// Computes the trends of one point for one width. Times must not decrease, except after Forget.
class Rollup {
 public:
  explicit Rollup(Millis width) : width_(width) {}

  /// Sets the value from `time` on; empty: the value is not good. `reading`: the value was read at
  /// this time. Appends the spans that have ended to `out`, except spans without good time.
  void Set(Millis time, std::optional<double> value, bool reading, std::vector<Trend>& out);
  /// Continues the present value until `time`, and appends the spans that have ended to `out`.
  void Advance(Millis time, std::vector<Trend>& out);
  /// Advances to `time`, appends the incomplete span to `out`, and clears the value.
  void Forget(Millis time, std::vector<Trend>& out);

 private:
  void Hold(Millis from, Millis until);
  void Close(std::vector<Trend>& out);

  Millis width_;
  Millis now_ = 0;
  std::optional<double> value_;
  double sum_ = 0;  // sum of (value - first) * milliseconds, scaled by kSmall
  Trend span_{};    // the present span; `good` is 0: no good value in the span yet
  bool begun_ = false;
};

enum class RunBegin : std::uint8_t { started, dropped, clock, standstill };
inline constexpr std::array<std::string_view, 4> kRunBegins = {"started", "dropped", "clock",
                                                               "standstill"};
inline std::string_view Name(RunBegin why) { return kRunBegins[static_cast<std::size_t>(why)]; }

struct Run {
  /// Number of the run, from 1. The recorder counts from 1 at each start of the gateway;
  /// PendingValues adds the last number in the files.
  std::int64_t number = 0;
  Millis began = 0;
  Millis until = 0;  ///< the history is complete until this time
  RunBegin why = RunBegin::started;
};

using PointNumber = std::uint32_t;  ///< index in config::History::points

struct Sample {
  PointNumber point = 0;
  std::int64_t run = 0;
  Entry entry{};
};

struct TrendRow {
  PointNumber point = 0;
  std::int64_t run = 0;
  Millis width = kMinute;  ///< kMinute or kHour
  Trend trend{};
};

struct Batch {
  std::vector<Run> runs;  ///< sorted by number; each with its present state
  std::vector<Sample> samples;
  std::vector<TrendRow> trends;

  bool empty() const { return runs.empty() && samples.empty() && trends.empty(); }
  void SetRun(const Run& run);
  void Append(Batch&& later);
};

struct PointName {
  std::string name;  ///< LINE.DEVICE.POINT
  config::Type type = config::Type::float32;
};

// `BatchQueue` is a queue of limited size for batches that wait while the disk is slow, full or
// failing. No lock: gateway/records/history/history_log.h provides it.
class BatchQueue {
 public:
  /// `most`: the limit of samples, and also the limit of trends.
  explicit BatchQueue(std::size_t most) : most_(most) {}

  std::size_t Room() const { return most_ - std::min(most_, waiting_.samples.size()); }
  /// Adds a batch with at most Room() samples. If there are too many trends, drops those of the
  /// batch and returns their number. Trends have a separate limit, because they are few and more
  /// valuable than samples.
  std::size_t Add(Batch&& batch) {
    std::size_t dropped = 0;
    if (waiting_.trends.size() + batch.trends.size() > most_) {
      dropped = batch.trends.size();
      batch.trends.clear();
    }
    waiting_.Append(std::move(batch));
    return dropped;
  }
  Batch TakeAll() { return std::exchange(waiting_, {}); }
  std::size_t samples() const { return waiting_.samples.size(); }

 private:
  const std::size_t most_;
  Batch waiting_;
};

// `PendingValues` contains the values that wait to be written, and changes their run numbers: the
// recorder counts runs from 1 at each start of the gateway, the files count on.
//
//   Begin(40), Add(run 1)   → run 41
//   CutRun()                → run 42: the file with the beginning of run 41 is lost
//   Add(run 1)              → run 42, which begins with the first value that waits
class PendingValues {
 public:
  /// Sets the last run number in the files. Must be called before the first Add.
  void Begin(std::int64_t last_run) { runs_before_ = last_run; }
  bool has_begun() const { return runs_before_.has_value(); }

  void Add(Batch&& batch);
  /// To be called when a file with stored values is lost. The values that wait begin a new run,
  /// because the time range of the lost values is unknown.
  void CutRun();
  bool TakeLost() { return std::exchange(lost_, false); }

  const Batch& batch() const { return batch_; }
  Batch& batch() { return batch_; }

 private:
  void Number(Batch& batch) const;

  Batch batch_;
  std::optional<std::int64_t> runs_before_;
  std::optional<Run> cut_;
  bool lost_ = false;
};

}  // namespace baudgate::history
