// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/alarm_board.h"

#include <algorithm>

namespace baudgate::events {

void AlarmBoard::Update(const Alarm& alarm) {
  const AlarmKey key = alarm.key();
  const MutexLock lock(mutex_);
  Change& change = alarms_[key];
  by_version_.erase(change.version);
  change = {++version_, alarm};
  by_version_.emplace(version_, key);
  if (alarms_.size() > kMost) Forget();
}

void AlarmBoard::Forget() {
  const auto normal = std::ranges::find_if(by_version_, [this](const auto& one) {
    return alarms_.at(one.second).alarm.state == AlarmState::normal;
  });
  if (normal == by_version_.end()) return;
  alarms_.erase(normal->second);
  by_version_.erase(normal);
}

std::vector<AlarmBoard::Change> AlarmBoard::Take(std::uint64_t after, std::size_t most) const {
  std::vector<Change> changes;
  const MutexLock lock(mutex_);
  for (auto at = by_version_.upper_bound(after); at != by_version_.end() && changes.size() < most;
       ++at) {
    changes.push_back(alarms_.at(at->second));
  }
  return changes;
}

}  // namespace baudgate::events
