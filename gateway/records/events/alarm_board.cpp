// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/alarm_board.h"

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
  for (auto at = by_version_.begin(); at != by_version_.end(); ++at) {
    const auto found = alarms_.find(at->second);
    if (found->second.alarm.state != AlarmState::normal) continue;
    alarms_.erase(found);
    by_version_.erase(at);
    return;
  }
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
