// `Recorder` takes the changes of the point store, decides which values are stored, and computes
// means over minutes and hours (trends). No thread, no clock, no disk:
// gateway/records/history/history_log.h provides these.
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

// `LogRule` decides whether a reading of a point is stored, by the last stored value. No clock, no
// disk.
//
//   deadband 0.5, stored 10.0 good    10.4 good: no        10.6 good: yes      10.0 uncertain: yes
//   max_gap 10min, stored at 12:00    same at 12:09: no    same at 12:10: yes
struct LogRule {
  bool every = false;
  Decimal deadband = 0;  ///< changes up to this size are not stored; 0: every change is stored
  Millis max_gap = 10 * kMinute;

  static LogRule Of(const config::HistoryPoint& point);
};

/// True if the reading `now` must be stored. `last`: the value stored last; null: no value was
/// stored, or changes after it are unknown.
bool IsKept(const LogRule& rule, const Entry* last, const Entry& now);

struct RecorderCounters {
  std::uint64_t readings = 0;
  /// Readings that were replaced by later readings before the recorder read them.
  std::uint64_t merged = 0;
  std::uint64_t kept = 0;
  std::uint64_t dropped = 0;  ///< entries that were dropped because the queue was full
};

class Recorder {
 public:
  /// The clock counts as set if it and the monotonic clock differ by more than this in the time
  /// between two calls of Take or Tick.
  static constexpr Duration kStep = 250ms;
  /// If more than this time has passed between two calls of Take or Tick, the process or its
  /// machine stood still.
  static constexpr Duration kStandstill = 5s;
  /// A minute or an hour is closed this long after its end, so that late readings are included. A
  /// reading that comes later still is stored with the earliest time that is this near to the end
  /// of its run, so that a reader (KeptReader) knows up to which time the run is complete.
  static constexpr Millis kSettle = 2 * kSecond;

  /// `store` must outlive this object.
  Recorder(const config::History& history, const bus::PointStore& store, Now now);

  /// Takes changes of the point store. `room`: the number of entries that fit into the queue. When
  /// the queue is full, nothing is stored until it has room for twice the number of points; then a
  /// new run begins.
  void Take(const bus::Changes& changes, Now now, std::size_t room, Batch& out);
  /// Closes minutes and hours that have ended. To be called at least once a second.
  void Tick(Now now, std::size_t room, Batch& out);
  /// Begins a new run, because the stored values of the present run are lost.
  void BeginAnew(Now now, std::size_t room, Batch& out);
  /// Closes all minutes, hours and the run. Must be the last call.
  void End(Now now, Batch& out);

  const RecorderCounters& counters() const { return counters_; }

 private:
  static constexpr PointNumber kNone = ~PointNumber{0};

  struct Point {
    explicit Point(const config::HistoryPoint& its) : rule(LogRule::Of(its)) {}
    LogRule rule;
    std::optional<Entry> latest;
    std::optional<Entry> kept;  // the value that was stored last in this run
    std::uint64_t seq = 0;      // last value of PointRecord::seq
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
  // Indices: device in the store, point in the device. Value: number of the point, or kNone.
  std::vector<std::vector<PointNumber>> numbers_;
  std::vector<Point> points_;
  Run run_;
  bool recording_ = true;
  std::size_t room_ = 0;
  Now last_;  // both clocks at the last call of Take or Tick
  std::vector<Seen> seen_;
  std::vector<Trend> ended_;
  RecorderCounters counters_;
};

// `ChangeRecorder` connects a Recorder to the change feed of the point store: it waits for changes,
// and calls Tick once a second. Used by one thread, except Wake.
class ChangeRecorder {
 public:
  /// `store` must outlive this object.
  ChangeRecorder(const config::History& history, bus::PointStore& store, Now now);
  ~ChangeRecorder() { store_.Unsubscribe(feed_); }
  ChangeRecorder(const ChangeRecorder&) = delete;
  ChangeRecorder& operator=(const ChangeRecorder&) = delete;

  /// Waits for changes or until the next tick. `last`: does not wait.
  void Wait(bool last) { feed_->Drain(last ? Instant() : tick_, changes_); }
  /// Ends a call of Wait early. Thread-safe.
  void Wake() { feed_->Wake(); }
  /// Returns the entries to store. To be called after Wait. `room`: see Recorder. `anew`: the
  /// stored values of the present run are lost.
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
