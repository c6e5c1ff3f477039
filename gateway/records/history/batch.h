// What goes from the recorder to the files: kept entries, spans that have ended, and the runs that
// they belong to.
//
// A run is a stretch of time in which the history knows of every change: it begins when the gateway
// starts, when values were dropped, when the clock of the machine was set. Between two runs nothing
// is known. Within a run the times of a point rise; the numbers of runs rise for ever, whatever the
// clock says.
//
// Entry is a value of a point, Rollup sums up spans, BatchQueue holds batches while the disk is
// slow, and PendingValues gives runs their numbers in the files.
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

// What stands in the history of a point: from this time on it had this value and this quality.

/// Milliseconds since 1970, UTC: the grain of all times in the history.
using Millis = std::int64_t;

inline Millis ToMillis(WallTime time) {
  return std::chrono::floor<std::chrono::milliseconds>(time).time_since_epoch().count();
}
inline WallTime ToWall(Millis time) { return WallTime(std::chrono::milliseconds(time)); }

inline constexpr Millis kSecond = 1000;
inline constexpr Millis kMinute = 60 * kSecond;
inline constexpr Millis kHour = 60 * kMinute;
inline constexpr Millis kDay = 24 * kHour;

/// The begin of the span of that width in which `time` lies; all spans count from 1970.
constexpr Millis FloorTo(Millis time, Millis width) {
  const Millis rest = time % width;
  return time - (rest < 0 ? rest + width : rest);
}

struct Entry {
  Millis time = 0;
  Value value{};  ///< empty: under a bad quality, or no number
  Quality quality = Quality::bad_waiting;

  bool operator==(const Entry&) const = default;
};

// Means and bounds of one point over spans of one width (a minute, an hour) that count from 1970,
// from every reading, before any of them is left out. A value counts from its reading until the
// next one; the mean is over the time in which it was good.
//
//   width 60 s; 0 s: 10   30 s: 20   90 s: bad   →   span 0: mean 15, min 10, max 20, first 10,
//   last 20, count 2, 60 s good                      span 60: mean 20, …, count 0, 30 s good
struct Trend {
  Millis begin = 0;
  double mean = 0;
  double min = 0;
  double max = 0;
  double first = 0;  ///< of the good ones in force during the span, one from before it included
  double last = 0;
  std::int64_t count = 0;  ///< good readings that came in it
  Millis good = 0;         ///< time of good quality; never 0

  bool operator==(const Trend&) const = default;
};

/// `later` is of the same span, and what was behind `trend`.
void Merge(Trend& trend, const Trend& later);

/// Times never run backwards between two calls of Forget.
class Rollup {
 public:
  explicit Rollup(Millis width) : width_(width) {}

  /// From now on this is in force; empty: what is not good. `reading`: it was read just now.
  /// Spans that have ended go to `out`; those without good time are left out.
  void Set(Millis time, std::optional<double> value, bool reading, std::vector<Trend>& out);
  /// What is in force stays so until now.
  void Advance(Millis time, std::vector<Trend>& out);
  /// Advance; and the span that has not ended goes to `out` as far as it came. Nothing is in force.
  void Forget(Millis time, std::vector<Trend>& out);

 private:
  void Hold(Millis from, Millis until);
  void Close(std::vector<Trend>& out);

  Millis width_;
  Millis now_ = 0;
  std::optional<double> value_;
  double sum_ = 0;  // of value - first, times milliseconds, made small
  Trend span_{};    // good is 0: nothing was good in it yet
  bool begun_ = false;
};

/// Why there is a gap before a run.
enum class RunBegin : std::uint8_t { started, dropped, clock, standstill };
inline constexpr std::array<std::string_view, 4> kRunBegins = {"started", "dropped", "clock",
                                                               "standstill"};
inline std::string_view Name(RunBegin why) { return kRunBegins[static_cast<std::size_t>(why)]; }

struct Run {
  std::int64_t number = 0;  ///< from 1 on; of the recorder: since the start of the gateway
  Millis began = 0;
  Millis until = 0;  ///< everything is known until then
  RunBegin why = RunBegin::started;
};

using PointNumber = std::uint32_t;  ///< in config::History::points

struct Sample {
  PointNumber point = 0;
  std::int64_t run = 0;
  Entry entry{};
};

struct TrendRow {
  PointNumber point = 0;
  std::int64_t run = 0;
  Millis width = kMinute;  ///< or kHour
  Trend trend{};
};

struct Batch {
  std::vector<Run> runs;  ///< by number; of each as it is now
  std::vector<Sample> samples;
  std::vector<TrendRow> trends;

  bool empty() const { return runs.empty() && samples.empty() && trends.empty(); }
  /// The newest word on a run counts.
  void SetRun(const Run& run);
  void Append(Batch&& later);
};

struct PointName {
  std::string name;  ///< LINE.DEVICE.POINT
  config::Type type = config::Type::float32;
};

// Bounded queue of batches that wait while the disk is slow, full or failing. No lock:
// gateway/records/history/history_log.h has it.
class BatchQueue {
 public:
  /// `most` samples, and as many spans.
  explicit BatchQueue(std::size_t most) : most_(most) {}

  /// So many samples fit in.
  std::size_t Room() const { return most_ - std::min(most_, waiting_.samples.size()); }
  /// With at most so many samples. Spans have places of their own: there are few, and they are
  /// worth more. Returns how many were dropped.
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

// The values that wait to be written, with the numbers of runs as in the files: those of the
// recorder begin at 1 with each start of the gateway.
//
//   Begin(40), Add(run 1)   → run 41
//   CutRun()                → run 42: the file that had the beginning of run 41 is lost
//   Add(run 1)              → run 42, which began where the values go on
//
class PendingValues {
 public:
  /// `last_run`: the last number in the files. Before the first Add.
  void Begin(std::int64_t last_run) { runs_before_ = last_run; }
  bool has_begun() const { return runs_before_.has_value(); }

  void Add(Batch&& batch);
  /// The file with the kept values is lost: values that wait begin a new run, because the time of
  /// the lost ones is unknown.
  void CutRun();
  /// Since the last call CutRun was called.
  bool TakeLost() { return std::exchange(lost_, false); }

  const Batch& batch() const { return batch_; }
  Batch& batch() { return batch_; }

 private:
  void Number(Batch& batch) const;

  Batch batch_;
  std::optional<std::int64_t> runs_before_;
  std::optional<Run> cut_;  // began in the middle of the recorder's
  bool lost_ = false;
};

}  // namespace baudgate::history
