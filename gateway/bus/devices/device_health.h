// Whether a device is there: decided from the outcomes of its exchanges by count *and* by time, so
// neither one lost reply nor a fast burst of retries makes a device offline. Time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/device_status.h"

namespace baudgate {

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

}  // namespace baudgate
