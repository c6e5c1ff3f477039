// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/devices/device_health.h"

#include <bit>

namespace baudgate {

void DeviceHealth::OnExchange(Outcome outcome) {
  if (outcome == Outcome::line_down) return;  // says nothing about the device
  const bool refused = outcome == Outcome::refused || outcome == Outcome::unsupported;
  refusals_ = refused ? refusals_ + 1 : 0;
  failures_ = (failures_ << 1U) | (ProvesLife(outcome) ? 0U : 1U);
}

void DeviceHealth::OnTask(Outcome outcome, Instant now) {
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

DeviceState DeviceHealth::state() const {
  if (offline_) return DeviceState::offline;
  if (!seen_) return DeviceState::never_seen;
  if (failed_tasks_ > 0 || std::popcount(failures_) >= kDegradedCount) return DeviceState::degraded;
  return DeviceState::online;
}

}  // namespace baudgate
