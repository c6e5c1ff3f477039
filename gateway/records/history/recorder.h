// Out of what changes in the point store: what is kept, and what it comes to by minutes and hours.
// No thread, no clock, no disk: gateway/records/history/history_log.h has them. LogRule decides
// about each reading, and ChangeRecorder drives Recorder from the change feed.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/records/history/batch.h"

namespace baudgate::history {

// Is this reading kept? The one decision about each reading, without clock and disk.
//
//   deadband 0.5, kept 10.0 good     10.4 good: no      10.6 good: yes      10.0 uncertain: yes
//   max_gap 10min, kept at 12:00     the same at 12:09: no      at 12:10: yes
struct LogRule {
  bool every = false;
  Decimal deadband = 0;  ///< a change by just so much is not kept; 0: every change is
  Millis max_gap = 10 * kMinute;

  static LogRule Of(const config::HistoryPoint& point);
};

/// `last`: the value kept last; null: none, or what happened since is not known.
bool IsKept(const LogRule& rule, const Entry* last, const Entry& now);

/// Since the start.
struct RecorderCounters {
  std::uint64_t readings = 0;
  std::uint64_t merged = 0;   ///< readings that a later one had replaced before it was looked
  std::uint64_t kept = 0;     ///< entries
  std::uint64_t dropped = 0;  ///< entries for which there was no room
};

class Recorder {
 public:
  /// A clock that goes faster or slower than this between two looks was set.
  static constexpr Duration kStep = 250ms;
  /// A gap of the clock longer than this: the process was stopped, or its machine was.
  static constexpr Duration kStandstill = 5s;
  /// Spans end this long after their time, so that readings from within them have come.
  static constexpr Millis kSettle = 2 * kSecond;

  /// `store` outlives it.
  Recorder(const config::History& history, const bus::PointStore& store, Now now);

  /// `room`: so many entries fit into the queue. Once they do not, nothing is kept until there is
  /// room for all points and more, and a new run begins.
  void Take(const bus::Changes& changes, Now now, std::size_t room, Batch& out);
  /// Now and then, at least once a second.
  void Tick(Now now, std::size_t room, Batch& out);
  /// What was kept of this run is lost: another one begins.
  void BeginAnew(Now now, std::size_t room, Batch& out);
  /// The last: all that is known, until now.
  void End(Now now, Batch& out);

  const RecorderCounters& counters() const { return counters_; }

 private:
  static constexpr PointNumber kNone = ~PointNumber{0};

  struct Point {
    explicit Point(const config::HistoryPoint& its) : rule(LogRule::Of(its)) {}
    LogRule rule;
    std::optional<Entry> latest;
    std::optional<Entry> kept;  // in this run
    std::uint64_t seq = 0;      // PointRecord::seq
    Rollup minute{kMinute};
    Rollup hour{kHour};
  };
  struct Seen {
    PointNumber point = 0;
    Value value;
    Quality quality;
    std::uint64_t seq = 0;
    WallTime source_time;
  };

  void Look(Now now, std::size_t room, Batch& out);
  void TakeOne(Seen& seen, Millis now, Batch& out);
  void Offer(PointNumber number, const Entry& entry, Batch& out);
  void Keep(PointNumber number, const Entry& entry, Batch& out);
  void BeginRun(RunBegin why, Millis now, Batch& out);
  void SetClock(Millis old_time, Millis new_time, Batch& out);
  void EndStandstill(Millis old_time, Now now, Batch& out);
  void TakeAll(Now now, Batch& out);
  void ForgetSpans(Millis time, Batch& out);
  void Emit(PointNumber number, Millis width, Batch& out);
  template <typename Each>
  void Roll(Each each, Batch& out);

  const bus::PointStore& store_;
  std::vector<std::vector<PointNumber>> numbers_;  // by device and point
  std::vector<Point> points_;
  Run run_;
  bool recording_ = true;
  std::size_t room_ = 0;  // of the look that goes on
  Now last_;              // look at the clocks
  std::vector<Seen> seen_;
  std::vector<Trend> ended_;
  RecorderCounters counters_;
};

// The recorder at the change feed of the point store: waits for what changes, and ticks once a
// second. On one thread, but for Wake.
class ChangeRecorder {
 public:
  /// `store` outlives it.
  ChangeRecorder(const config::History& history, bus::PointStore& store, Now now);
  ~ChangeRecorder() { store_.Unsubscribe(feed_); }
  ChangeRecorder(const ChangeRecorder&) = delete;
  ChangeRecorder& operator=(const ChangeRecorder&) = delete;

  /// Returns when something has changed, or at the next tick; with `last` at once.
  void Wait(bool last) { feed_->Drain(last ? Instant() : tick_, changes_); }
  /// Ends a Wait. From any thread.
  void Wake() { feed_->Wake(); }
  /// After Wait: what is to be kept. `room`: see Recorder. `anew`: what was kept of this run is
  /// lost.
  Batch Take(Now now, std::size_t room, bool anew, bool last);
  const RecorderCounters& counters() const { return recorder_.counters(); }

 private:
  static constexpr Duration kTick = 1s;

  bus::PointStore& store_;
  const std::shared_ptr<bus::ChangeFeed> feed_;
  Recorder recorder_;
  bus::Changes changes_;
  Instant tick_{};
};

}  // namespace baudgate::history
