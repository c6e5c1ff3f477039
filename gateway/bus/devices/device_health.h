// Whether a device is there: decided from the outcomes of its exchanges by count *and* by time, so
// neither one lost reply nor a fast burst of retries makes a device offline. Time is an argument.
// HeardPoints keeps which points were answered.
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

// Which points of a device were answered since it was connected. It decides one question: does
// silence to a request say something about the device, or about the points that were asked for?
// Many devices are silent to points that they do not have.
//
//   p was answered, q never; p is answered at 1 s
//   silence to p at 2 s     about the device
//   silence to q at 2 s     about q
//   silence to q at 12 s    about the device: it has not answered anything for 10 s
//   a late reply            for ten minutes silence may be lateness: about the device
//
class HeardPoints {
 public:
  /// It may be another device now.
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
  /// Offline after this many failed tasks in a row (each with its retries) that span at least this
  /// time.
  static constexpr int kOfflineCount = 3;
  static constexpr Duration kOfflineTime = 1s;
  /// Degraded while at least this many of the last 32 exchanges failed.
  static constexpr int kDegradedCount = 3;

  /// Every exchange, retries included: decides about degraded.
  void OnExchange(Outcome outcome);
  /// The end of a task: decides about online and offline.
  void OnTask(Outcome outcome, Instant now);

  DeviceState state() const;
  /// Only probes are sent to it: it went offline, or it has not answered its first task. Its
  /// state() is never_seen in the second case.
  bool absent() const { return offline_ || (!seen_ && failed_tasks_ > 0); }
  /// Its last two exchanges were refused: it is there, but gives nothing.
  bool refuses() const { return refusals_ > 1; }
  /// Its last task failed.
  bool failing() const { return failed_tasks_ > 0; }

 private:
  std::uint32_t failures_ = 0;  // one bit per exchange, the latest lowest
  int refusals_ = 0;            // in a row
  int failed_tasks_ = 0;
  Instant failing_since_{};
  bool seen_ = false;
  bool offline_ = false;
};

inline void DeviceHealth::OnExchange(Outcome outcome) {
  if (outcome == Outcome::line_down) return;  // says nothing about the device
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
