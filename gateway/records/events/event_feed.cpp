// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_feed.h"

#include <algorithm>
#include <utility>

namespace baudgate::events {

void EventFeed::Begin(FeedImage image) {
  {
    const MutexLock lock(mutex_);
    if (!recent_.empty()) return;
    for (const Alarm& alarm : image.alarms) alarms_.Update(alarm);
    recent_.Begin(std::move(image));
  }
  listeners_.Wake();
}

void EventFeed::Add(std::vector<EventRecord> events) {
  if (events.empty()) return;
  {
    const MutexLock lock(mutex_);
    for (const EventRecord& event : events) {
      if (event.alarm) alarms_.Update(*event.alarm);
    }
    recent_.Add(std::move(events));
  }
  listeners_.Wake();
}

void EventFeed::Renumber(const SourceNames& sources) {
  const MutexLock lock(mutex_);
  numbers_.clear();
  for (std::size_t number = 0; number < sources.size(); ++number) {
    const std::string& device = sources[number].second;
    if (!device.empty()) numbers_.emplace(device, static_cast<Source>(number));
  }
}

/// An event of the gateway about a device is shown as an event of that device.
FedEvent EventFeed::Numbered(EventRecord record) const {
  const auto found = numbers_.find(record.device);
  return {found == numbers_.end() ? kGateway : found->second, std::move(record)};
}

EventFeed::Shown EventFeed::Show(std::optional<Source> source, std::uint32_t first,
                                 std::size_t most) const {
  Shown shown;
  const MutexLock lock(mutex_);
  shown.newest = recent_.newest();
  if (recent_.empty()) return shown;
  shown.oldest = recent_.oldest();
  const std::string* device = nullptr;
  if (source) {
    const auto found =
        std::ranges::find(numbers_, *source, &std::map<std::string, Source>::value_type::second);
    if (found == numbers_.end()) return shown;
    device = &found->first;
  }
  if (first == 0) {
    shown.events = recent_.Newest(device, most);
  } else {
    const std::int64_t from = recent_.Whole(first);
    shown.lost = recent_.Lost(from, device);
    shown.events = recent_.From(from, device, most);
  }
  return shown;
}

std::vector<FedEvent> EventFeed::Take(std::int64_t after, std::size_t most) {
  const bool served = IsServed();
  std::vector<FedEvent> taken;
  {
    const MutexLock lock(mutex_);
    std::optional<std::vector<EventRecord>> read;
    if (served && recent_.HasLeft(after)) read = backlog_.Take(after, most);
    const bool helps = read && !read->empty() && read->front().seq < recent_.oldest();
    if (helps) {
      for (EventRecord& event : *read) taken.push_back(Numbered(std::move(event)));
      return taken;
    }
    if (read || !served || !recent_.HasLeft(after)) {
      for (EventRecord& event : recent_.From(after + 1, nullptr, most)) {
        taken.push_back(Numbered(std::move(event)));
      }
      return taken;
    }
  }
  const MutexLock lock(asking_);
  if (asked_) asked_();
  return taken;
}

std::optional<std::int64_t> EventFeed::wanted() const {
  const MutexLock lock(mutex_);
  return backlog_.wanted();
}

void EventFeed::Supply(std::int64_t after, std::vector<EventRecord> events) {
  {
    const MutexLock lock(mutex_);
    backlog_.Supply(after, std::move(events));
  }
  listeners_.Wake();
}

void EventFeed::ServeWith(std::function<void()> asked) {
  const MutexLock lock(asking_);
  asked_ = std::move(asked);
}

bool EventFeed::IsServed() const {
  const MutexLock lock(asking_);
  return asked_ != nullptr;
}

std::int64_t EventFeed::newest() const {
  const MutexLock lock(mutex_);
  return recent_.newest();
}

}  // namespace baudgate::events
