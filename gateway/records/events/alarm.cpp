// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/alarm.h"

#include <array>

#include "gateway/records/events/event_record.h"

namespace baudgate::events {
namespace {

using Step = AlarmMark::Step;

constexpr std::size_t kAlarmStates = 4;

AlarmState After(AlarmState before, Step step) {
  switch (step) {
    case Step::raise:
      return AlarmState::active;
    case Step::clear:
      if (before == AlarmState::active) return AlarmState::returned;
      return before == AlarmState::acknowledged ? AlarmState::normal : before;
    case Step::pulse:
      return IsActive(before) ? before : AlarmState::returned;
    case Step::acknowledge:
      if (before == AlarmState::active) return AlarmState::acknowledged;
      return before == AlarmState::returned ? AlarmState::normal : before;
    case Step::priority:
    case Step::none:
      break;
  }
  return before;
}

Alarm NewAlarm(const EventRecord& event) {
  Alarm alarm;
  alarm.line = event.line;
  alarm.device = event.device;
  alarm.name = event.subject;
  alarm.point = event.mark.point;
  return alarm;
}

}  // namespace

std::string_view Name(AlarmState state) {
  constexpr std::array<std::string_view, kAlarmStates> kNames = {"normal", "active", "acknowledged",
                                                                 "returned"};
  return kNames[static_cast<std::size_t>(state)];
}

std::string PlaceOf(const Alarm& alarm) {
  std::string place = alarm.line;
  for (const std::string& part : {alarm.device, alarm.point}) {
    if (!part.empty()) place += (place.empty() ? "" : ".") + part;
  }
  return place.empty() ? "gateway" : place;
}

AlarmChange Apply(const Alarm* before, const EventRecord& event) {
  const AlarmMark& mark = event.mark;
  if (mark.step == Step::none) return {};
  const AlarmState was = before == nullptr ? AlarmState::normal : before->state;
  const bool acknowledges = mark.step == Step::acknowledge;
  if (acknowledges) {
    const bool meant = mark.seq == 0 || (before != nullptr && before->seq == mark.seq);
    if (!meant || !IsUnacknowledged(was)) return {.counts = false};
  }
  if (mark.first && IsActive(was) == (mark.step == Step::raise)) return {.counts = false};
  const bool reprioritised = mark.step == Step::priority && IsActive(was) && before != nullptr &&
                             before->priority != mark.priority;
  const AlarmState is = After(was, mark.step);
  const bool begins = mark.step == Step::raise ? was != AlarmState::active
                                               : mark.step == Step::pulse && !IsActive(was);
  if (is == was && !begins && !reprioritised) return {};
  Alarm alarm = before == nullptr ? NewAlarm(event) : *before;
  alarm.state = is;
  alarm.changed = event.received;
  if (acknowledges) alarm.by = mark.by;
  if (begins || reprioritised) alarm.priority = mark.priority;
  if (begins) {
    alarm.seq = event.seq;
    alarm.raised = event.device_time;
    alarm.text = event.text;
    alarm.by.clear();
  }
  return {.alarm = std::move(alarm)};
}

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
