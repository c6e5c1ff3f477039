// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_book.h"

#include "gateway/records/events/own_records.h"

namespace baudgate::events {

Shares::Key Shares::KeyOf(const EventRecord& record) {
  return {record.line, record.device, record.code, record.subject};
}

void Shares::Fill(Share& share, Instant now) {
  if (share.left == kAtOnce) {
    share.filled = now;
    share.settles = kSettles;
  }
  const auto more = std::min<std::int64_t>((now - share.filled) / kEach, kAtOnce - share.left);
  share.left += static_cast<int>(more);
  share.filled += more * kEach;
}

bool Shares::Take(const EventRecord& record, bool room, Instant now) {
  Share& share = shares_[KeyOf(record)];
  Fill(share, now);
  if (room && share.left_out == 0 && share.left > 0 && share.waiting < kAtOnce) {
    --share.left;
    ++share.waiting;
    return true;
  }
  if (share.left_out == 0) share.since = record.received;
  ++share.left_out;
  ++left_out_;
  share.last = record;
  share.last_at = now;
  return false;
}

void Shares::OnKept(const EventRecord& record) {
  const auto found = shares_.find(KeyOf(record));
  if (found != shares_.end() && found->second.waiting > 0) --found->second.waiting;
}

std::vector<EventRecord> Shares::TakeLeftOut(Now now, bool all) {
  std::vector<EventRecord> records;
  for (auto& [key, share] : shares_) {
    if (share.left_out == 0) continue;
    Fill(share, now.instant);
    if (share.left == 0) {
      if (!all && now.instant < share.SettledAt()) continue;
      share.settles = std::min(2 * share.settles, kEach);
    } else {
      --share.left;
    }
    ++share.waiting;
    const std::uint64_t more = std::exchange(share.left_out, 0) - 1;
    if (more > 0) records.push_back(LeftOutRecord(more, share.last, share.since, now.wall));
    records.push_back(std::move(share.last));
    share.last = {};
  }
  return records;
}

std::optional<Instant> Shares::NextAt() const {
  std::optional<Instant> next;
  for (const auto& [key, share] : shares_) {
    if (share.left_out == 0) continue;
    const Instant at =
        share.left > 0 ? Instant::min() : std::min(share.filled + kEach, share.SettledAt());
    if (!next || at < *next) next = at;
  }
  return next;
}

namespace {

void Merge(const std::map<AlarmKey, Alarm>& changes, std::map<AlarmKey, Alarm>& alarms) {
  for (const auto& [key, alarm] : changes) {
    if (alarm.state == AlarmState::normal) {
      alarms.erase(key);
    } else {
      alarms.insert_or_assign(key, alarm);
    }
  }
}

}  // namespace

void EventBook::Add(Batch batch) { waiting_.push_back(std::move(batch)); }

void EventBook::TellAlways(EventRecord record) {
  ++own_;
  waiting_.push_back({.source = kGateway, .events = {std::move(record)}});
}

void EventBook::Tell(EventRecord record, Instant now) {
  if (shares_.Take(record, own_ < kMostOwn, now)) TellAlways(std::move(record));
}

void EventBook::TellFirst(EventRecord record) {
  ++own_;
  waiting_.push_front({.source = kGateway, .events = {std::move(record)}});
}

void EventBook::TellLeftOut(Now now, bool all) {
  for (EventRecord& record : shares_.TakeLeftOut(now, all)) TellAlways(std::move(record));
}

void EventBook::OnOpened(std::int64_t last, const Said& said, const std::vector<Alarm>& alarms) {
  last_ = std::max(last_, last);
  said_.insert(said.begin(), said.end());
  if (std::exchange(opened_, true)) return;
  for (const Alarm& alarm : alarms) alarms_.emplace(alarm.key(), alarm);
}

std::string EventBook::said(const SourceName& source) const {
  const auto found = said_.find(source);
  return found == said_.end() ? std::string() : found->second;
}

bool EventBook::IsRepeat(const Batch& batch, const Said& said) const {
  const auto found = said.find(batch.name());
  return batch.again && found != said.end() && found->second == batch.said;
}

const Alarm* EventBook::Find(const AlarmKey& key) const {
  const auto changed = after_.alarms.find(key);
  if (changed != after_.alarms.end()) {
    return changed->second.state == AlarmState::normal ? nullptr : &changed->second;
  }
  const auto kept = alarms_.find(key);
  return kept == alarms_.end() ? nullptr : &kept->second;
}

bool EventBook::Counts(EventRecord& event) {
  event.seq = after_.last + 1;
  if (event.mark.step != AlarmMark::Step::none) {
    const AlarmKey key(event.line, event.device, event.subject);
    const Alarm* const before = Find(key);
    AlarmChange change = Apply(before, event);
    if (!change.counts) return false;
    const bool room = before != nullptr || alarms_.size() + after_.alarms.size() < kMostAlarms;
    if (change.alarm && room) {
      after_.alarms[key] = *change.alarm;
      event.alarm = std::move(change.alarm);
    }
  }
  ++after_.last;
  return true;
}

std::vector<Batch> EventBook::Prepare() {
  after_ = {.last = last_, .said = said_, .repeats = repeats_};
  std::vector<Batch> due(waiting_.begin(), waiting_.end());
  for (Batch& batch : due) {
    std::vector<EventRecord> events = std::exchange(batch.events, {});
    if (IsRepeat(batch, after_.said)) {
      after_.repeats += events.size();
      events.clear();
      batch.past.clear();
    }
    for (EventRecord& event : events) {
      if (Counts(event)) batch.events.push_back(std::move(event));
    }
    if (batch.source != kGateway) after_.said[batch.name()] = batch.said;
  }
  expected_ = after_.alarms;
  return due;
}

std::vector<Batch> EventBook::Ahead() {
  After being_written = std::exchange(after_, {});
  std::vector<Batch> batches = Prepare();
  after_ = std::move(being_written);
  return batches;
}

void EventBook::TakeTold(std::vector<Batch>& batches) const {
  for (std::size_t i = 0; i < std::min(batches.size(), waiting_.size()); ++i) {
    batches[i].told = waiting_[i].told;
  }
}

std::map<AlarmKey, Alarm> EventBook::Expected() const {
  std::map<AlarmKey, Alarm> alarms = alarms_;
  Merge(expected_, alarms);
  return alarms;
}

std::vector<Alarm> EventBook::Alarms(bool expected) const {
  std::vector<Alarm> alarms;
  const auto take = [&alarms](const std::map<AlarmKey, Alarm>& all) {
    for (const auto& [key, alarm] : all) alarms.push_back(alarm);
  };
  expected ? take(Expected()) : take(alarms_);
  return alarms;
}

void EventBook::OnTold(std::size_t batches) {
  for (std::size_t i = 0; i < std::min(batches, waiting_.size()); ++i) waiting_[i].told = true;
}

std::vector<SourceName> EventBook::Kept(std::size_t batches) {
  std::vector<SourceName> sources;
  for (; batches > 0; --batches) {
    const Batch& batch = waiting_.front();
    if (batch.source == kGateway) {
      --own_;
      for (const EventRecord& event : batch.events) shares_.OnKept(event);
    } else {
      sources.push_back(batch.name());
    }
    waiting_.pop_front();
  }
  last_ = after_.last;
  said_ = std::move(after_.said);
  repeats_ = after_.repeats;
  Merge(std::exchange(after_.alarms, {}), alarms_);
  return sources;
}

}  // namespace baudgate::events
