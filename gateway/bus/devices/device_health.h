// `DeviceHealth` decides from the outcomes of its exchanges whether a device is online. It requires
// a number of failures *and* a time: neither one lost reply nor a fast burst of retries makes a
// device offline. `HeardPoints` records which points the device has answered. The classes
// read no clock: the time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/device_status.h"

namespace baudgate::bus {

// `HeardPoints` decides what silence to a request means: the device is gone, or the device does not
// have the requested points. Many devices do not answer requests for unknown points. Example:
//
//   point p was answered before, and again at 1 s; point q was never answered
//   silence to p at 2 s     concerns the device
//   silence to q at 2 s     concerns q
//   silence to q at 12 s    concerns the device: it has not answered anything for 10 s
//   after a late reply      for ten minutes all silence concerns the device: its reply may be late
//
class HeardPoints {
 public:
  /// Forgets all answers. Call when another device may be connected.
  void Clear() {
    heard_.clear();
    last_.reset();
    late_.reset();
  }
  void OnLate(Instant now) { late_ = now; }
  void OnValue(std::size_t point, Instant now) {
    if (heard_.size() <= point) heard_.resize(point + 1);
    heard_[point] = true;
    last_ = now;
  }
  /// Returns true if silence to a request for `points` concerns the device, false if it concerns
  /// the points.
  bool TellsOfDevice(const std::vector<std::size_t>& points, Instant now) const {
    if (!last_ || now - *last_ > kTrusted) return true;
    if (late_ && now - *late_ < kLate) return true;
    return std::ranges::any_of(
        points, [this](std::size_t point) { return point < heard_.size() && heard_[point]; });
  }

 private:
  static constexpr Duration kTrusted = 10s;
  static constexpr Duration kLate = 10min;

  std::vector<bool> heard_;
  std::optional<Instant> last_;
  std::optional<Instant> late_;
};

class DeviceHealth {
 public:
  /// A device is offline after this many failed tasks in a row (a task includes its retries), if at
  /// least kOfflineTime has passed from the first to the last of them.
  static constexpr int kOfflineCount = 3;
  static constexpr Duration kOfflineTime = 1s;
  /// A device that is not offline is degraded while its last task has failed, or while at least
  /// this many of its last 32 exchanges failed.
  static constexpr int kDegradedCount = 3;

  /// Call for every exchange, including retries.
  void OnExchange(Outcome outcome);
  /// Call at the end of a task (a request with its retries).
  void OnTask(Outcome outcome, Instant now);

  DeviceState state() const;
  /// True if only probes are sent to the device: it is offline, or it did not answer its first task
  /// (then state() returns never_seen).
  bool absent() const { return offline_ || (!seen_ && failed_tasks_ > 0); }
  /// True if the last two exchanges were refused: the device works, but provides no values.
  bool refuses() const { return refusals_ > 1; }
  bool failing() const { return failed_tasks_ > 0; }

 private:
  std::uint32_t failures_ = 0;  // one bit per exchange, 1: it failed; the latest is bit 0
  int refusals_ = 0;
  int failed_tasks_ = 0;
  Instant failing_since_{};
  bool seen_ = false;
  bool offline_ = false;
};

inline void DeviceHealth::OnExchange(Outcome outcome) {
  if (outcome == Outcome::line_down) return;
  const bool refused = outcome == Outcome::refused || outcome == Outcome::unsupported;
  refusals_ = refused ? refusals_ + 1 : 0;
  failures_ = (failures_ << 1U) | (ProvesLife(outcome) ? 0U : 1U);
}

inline void DeviceHealth::OnTask(Outcome outcome, Instant now) {
  if (outcome == Outcome::line_down) return;
  if (ProvesLife(outcome)) {
    if (offline_) failures_ = 0;
    failed_tasks_ = 0;
    offline_ = false;
    seen_ = true;
    return;
  }
  if (failed_tasks_ == 0) failing_since_ = now;
  ++failed_tasks_;
  if (failed_tasks_ >= kOfflineCount && now - failing_since_ >= kOfflineTime) offline_ = true;
}

inline DeviceState DeviceHealth::state() const {
  if (offline_) return DeviceState::offline;
  if (!seen_) return DeviceState::never_seen;
  if (failed_tasks_ > 0 || std::popcount(failures_) >= kDegradedCount) return DeviceState::degraded;
  return DeviceState::online;
}

}  // namespace baudgate::bus
