// The recorder at the change feed of the point store: waits for what changes, and ticks once a
// second. On one thread, but for Wake.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "gateway/bus/points/change_feed.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/records/history/recorder.h"

namespace baudgate::history {

class ChangeRecorder {
 public:
  /// `store` outlives it.
  ChangeRecorder(const config::History& history, PointStore& store, Now now);
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

  PointStore& store_;
  const std::shared_ptr<ChangeFeed> feed_;
  Recorder recorder_;
  Changes changes_;
  Instant tick_{};
};

}  // namespace baudgate::history
