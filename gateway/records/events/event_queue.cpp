// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_queue.h"

#include <string_view>

#include "gateway/base/text.h"
#include "gateway/records/events/own_alarms.h"
#include "gateway/records/events/point_watch.h"

namespace baudgate::events {
namespace {

/// Adds an event to the book for each unacknowledged alarm that `query` selects. Returns the number
/// of these alarms.
std::size_t TellAcks(const AckQuery& query, const std::vector<Alarm>& alarms, EventBook& book,
                     WallTime at) {
  std::size_t count = 0;
  for (const Alarm& alarm : alarms) {
    if (!IsUnacknowledged(alarm.state) || !query.Means(alarm)) continue;
    book.TellAlways(AckRecord(alarm, query, at));
    ++count;
  }
  return count;
}

}  // namespace

void AnswerAcks(const std::vector<WaitingAck>& acks, const std::string& trouble) {
  for (const WaitingAck& ack : acks) ack.done({ack.alarms, trouble, ack.at});
}

namespace {

using Priority = std::optional<config::AlarmPriority>;

Priority Alarming(config::AlarmPriority priority) {
  return priority == config::AlarmPriority::none ? std::nullopt : Priority(priority);
}

/// Returns the priority of the event with this name. Example: "2:17" is channel 2, code 17.
Priority OfEvent(const config::Device& device, std::string_view name) {
  const auto parts = Split(name, ':');
  if (parts.size() != 2) return std::nullopt;
  const auto channel = ParseInteger<std::uint32_t>(parts[0]);
  const auto code = ParseInteger<std::uint32_t>(parts[1]);
  if (!channel || !code) return std::nullopt;
  const auto* known = config::FindEvent(device.event_texts, *channel, *code);
  return known != nullptr ? Alarming(known->alarm) : std::nullopt;
}

Priority OfDevice(const config::Device& device, const Alarm& alarm) {
  if (alarm.point.empty()) {
    return device.events ? OfEvent(device, alarm.name) : std::nullopt;
  }
  if (!device.point_events) return std::nullopt;
  for (const config::Point& point : device.points) {
    if (point.name != alarm.point) continue;
    for (const config::PointEvent& event : point.events) {
      if (SubjectOf(point, event) == alarm.name) return Alarming(event.alarm);
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<config::AlarmPriority> PriorityOf(const config::Config& config, const Alarm& alarm) {
  if (const auto trouble = TroubleNamed(alarm.name); trouble && alarm.point.empty()) {
    const auto setting = SettingOf(config, *trouble, alarm.line, alarm.device);
    return setting && setting->on() ? Priority(setting->priority) : std::nullopt;
  }
  for (const config::Line& line : config.lines) {
    if (line.name != alarm.line) continue;
    for (const config::Device& device : line.devices) {
      if (device.name == alarm.device) return OfDevice(device, alarm);
    }
  }
  return std::nullopt;
}

void WatchedAlarms::Follow(EventBook& book, WallTime at) const {
  if (!watched_) return;
  for (const auto& [key, alarm] : book.alarms()) {
    if (!IsActive(alarm.state)) continue;
    const auto priority = watched_(alarm);
    if (!priority) {
      book.TellAlways(NotWatchedRecord(alarm, at));
    } else if (*priority != alarm.priority) {
      book.TellAlways(PriorityRecord(alarm, *priority, at));
    }
  }
}

void EventQueue::Add(Batch batch) {
  {
    const MutexLock lock(pending_.mutex);
    pending_.book.Add(std::move(batch));
  }
  pending_.wake();
}

void EventQueue::Tell(EventRecord record) {
  const Instant now = options_.clocks().instant;
  {
    const MutexLock lock(pending_.mutex);
    pending_.book.Tell(std::move(record), now);
  }
  pending_.wake();
}

void EventQueue::Keep(KeptRecord record) {
  {
    const MutexLock lock(pending_.mutex);
    if (pending_.records.size() < EventBook::kMostOwn) {
      pending_.records.push_back(std::move(record));
    }
  }
  pending_.wake();
}

void EventQueue::Started(const std::string& version) {
  if (!options_.tells_own) return;
  {
    const MutexLock lock(pending_.mutex);
    pending_.run.OnStarted(version, options_.clocks().wall);
  }
  pending_.wake();
}

void EventQueue::TellEnd() {
  const Now now = options_.clocks();
  const MutexLock lock(pending_.mutex);
  pending_.book.TellLeftOut(now, true);
  if (auto end = pending_.run.TakeEnd(now.wall)) pending_.book.TellAlways(std::move(*end));
}

void EventQueue::End(Duration most) {
  const Instant until = options_.clocks().instant + most;
  TellEnd();
  pending_.wake();
  MutexLock lock(pending_.mutex);
  while (!pending_.IsIdle() && pending_.disk.trouble().empty() &&
         lock.WaitUntil(pending_.changed, until)) {
  }
}

std::size_t EventQueue::Acknowledge(const AckQuery& query,
                                    std::function<void(const Acknowledged&)> done) {
  Acknowledged now;
  {
    const MutexLock lock(pending_.mutex);
    now.at = options_.clocks().wall;
    now.alarms = TellAcks(query, pending_.Alarms(), pending_.book, now.at);
    now.trouble = pending_.disk.trouble();
    if (now.alarms > 0 && now.trouble.empty()) {
      pending_.acks.push_back({now.alarms, now.at, std::exchange(done, nullptr)});
    }
  }
  pending_.wake();
  if (done) done(now);
  return now.alarms;
}

void EventQueue::WhenOpened(std::function<void()> opened) {
  {
    const MutexLock lock(pending_.mutex);
    if (!pending_.book.opened()) {
      pending_.on_opened = std::move(opened);
      return;
    }
  }
  opened();
}

bool EventQueue::opened() const {
  const MutexLock lock(pending_.mutex);
  return pending_.book.opened();
}

/// Events that were added before the reload can raise alarms of lines that have ended. Therefore
/// these events are written first, and the alarms are compared with the configuration after that.
void EventQueue::Renumber(SourceNames sources, Watched watches) {
  const Now at = options_.clocks();
  const MutexLock lock(pending_.mutex);
  pending_.watched.Renew(std::move(watches));
  pending_.book.TellLeftOut(at, true);
  if (options_.feed) options_.feed->Renumber(sources);
  pending_.numbers.Renew(std::move(sources));
  pending_.wake();
}

std::string EventQueue::said(Source source) const {
  const MutexLock lock(pending_.mutex);
  return pending_.book.said(pending_.numbers.NameOf(source));
}

EventsState EventQueue::state() const {
  const MutexLock lock(pending_.mutex);
  EventsState state;
  pending_.disk.Fill(state);
  state.put_aside = pending_.disk.put_aside();
  state.file = options_.file.string();
  state.in_memory = options_.in_memory;
  state.oldest = pending_.oldest;
  state.waiting = pending_.book.waiting();
  state.newest = pending_.book.newest();
  state.repeats = pending_.book.repeats();
  state.left_out = pending_.book.left_out();
  for (const Alarm& alarm : pending_.Alarms()) {
    state.alarms_active += IsActive(alarm.state) ? 1 : 0;
    state.alarms_unacknowledged += IsUnacknowledged(alarm.state) ? 1 : 0;
  }
  return state;
}

std::vector<Alarm> EventQueue::Alarms() const {
  const MutexLock lock(pending_.mutex);
  return pending_.Alarms();
}

}  // namespace baudgate::events
