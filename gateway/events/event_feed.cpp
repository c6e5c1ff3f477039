// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_feed.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace baudgate::events {
void EventFeed::Begin(FeedImage image) {
  {
    const MutexLock lock(mutex_);
    if (!events_.empty()) return;
    newest_ = std::max(newest_, image.newest);
    for (const Alarm& alarm : image.alarms) alarms_.Update(alarm);
    std::ranges::move(image.events, std::back_inserter(events_));
    for (const GoneEvent& gone : image.gone) Forget(gone.seq, gone.device);
    older_ = std::move(image.older);
    Drop();
  }
  Wake();
}

void EventFeed::Add(std::vector<EventRecord> events) {
  if (events.empty()) return;
  {
    const MutexLock lock(mutex_);
    for (const EventRecord& event : events) {
      if (event.alarm) alarms_.Update(*event.alarm);
    }
    std::ranges::move(events, std::back_inserter(events_));
    newest_ = events_.back().seq;
    Drop();
  }
  Wake();
}

void EventFeed::Renumber(const SourceNames& sources) {
  const MutexLock lock(mutex_);
  devices_.clear();
  numbers_.clear();
  for (std::size_t number = 0; number < sources.size(); ++number) {
    const std::string& device = sources[number].second;
    if (device.empty()) continue;
    devices_.emplace(static_cast<Source>(number), device);
    numbers_.emplace(device, static_cast<Source>(number));
  }
}

/// An event of the gateway about a device is shown as an event of that device.
FedEvent EventFeed::Numbered(EventRecord record) const {
  const auto found = numbers_.find(record.device);
  return {found == numbers_.end() ? kGateway : found->second, std::move(record)};
}

void EventFeed::Forget(std::int64_t seq, const std::string& device) {
  gone_.push_back({seq, &*gone_devices_.insert(device).first});
}

void EventFeed::Drop() {
  for (; events_.size() > limits_.events; events_.pop_front()) {
    Forget(events_.front().seq, events_.front().device);
  }
  for (; gone_.size() > limits_.remembered; gone_.pop_front()) {
    older_[*gone_.front().device] = gone_.front().seq;
  }
}

EventFeed::Listener EventFeed::Listen(std::function<void()> wake) {
  const MutexLock lock(waking_);
  listeners_.emplace(next_, std::move(wake));
  return next_++;
}

void EventFeed::Leave(Listener listener) {
  const MutexLock lock(waking_);
  listeners_.erase(listener);
}

void EventFeed::Wake() const {
  const MutexLock lock(waking_);
  for (const auto& [listener, wake] : listeners_) wake();
}

/// The number with these low bits that is nearest to what there is.
std::int64_t EventFeed::Whole(std::uint32_t number) const {
  constexpr std::int64_t kTurn = std::int64_t{1} << 32;
  const std::int64_t whole = newest_ / kTurn * kTurn + number;
  return whole > newest_ + kTurn / 2 && whole > kTurn ? whole - kTurn : whole;
}

std::uint64_t EventFeed::Lost(const std::string* device, std::int64_t first) const {
  const std::int64_t oldest = events_.empty() ? newest_ + 1 : events_.front().seq;
  const std::int64_t known = gone_.empty() ? oldest : gone_.front().seq;
  std::uint64_t lost = 0;
  if (first < known) {
    const auto older = device != nullptr ? older_.find(*device) : older_.end();
    const bool had_none = device != nullptr && (older == older_.end() || older->second < first);
    if (!had_none) lost = static_cast<std::uint64_t>(known - first);
  }
  const auto from = std::ranges::lower_bound(gone_, first, {}, &Gone::seq);
  return lost + static_cast<std::uint64_t>(std::count_if(from, gone_.end(), [&](const Gone& gone) {
           return device == nullptr || *gone.device == *device;
         }));
}

EventFeed::Shown EventFeed::Show(std::optional<Source> source, std::uint32_t first,
                                 std::size_t most) const {
  Shown shown;
  const MutexLock lock(mutex_);
  shown.newest = newest_;
  if (events_.empty()) return shown;
  shown.oldest = events_.front().seq;
  const std::string* device = nullptr;
  if (source) {
    const auto found = devices_.find(*source);
    if (found == devices_.end()) return shown;
    device = &found->second;
  }
  const auto wanted = [device](const EventRecord& event) {
    return device == nullptr || event.device == *device;
  };
  if (first == 0) {
    for (auto at = events_.rbegin(); at != events_.rend() && shown.events.size() < most; ++at) {
      if (wanted(*at)) shown.events.push_back(*at);
    }
    std::ranges::reverse(shown.events);
    return shown;
  }
  const std::int64_t from = Whole(first);
  if (from < shown.oldest) shown.lost = Lost(device, from);
  auto at = std::ranges::lower_bound(events_, from, {}, &EventRecord::seq);
  for (; at != events_.end() && shown.events.size() < most; ++at) {
    if (wanted(*at)) shown.events.push_back(*at);
  }
  return shown;
}

bool EventFeed::HasLeft(std::int64_t after) const {
  return !events_.empty() && after + 1 < events_.front().seq;
}

std::vector<FedEvent> EventFeed::Take(std::int64_t after, std::size_t most) {
  const bool served = IsServed();
  std::vector<FedEvent> taken;
  {
    const MutexLock lock(mutex_);
    std::optional<std::vector<EventRecord>> read;
    if (served && HasLeft(after)) read = backlog_.Take(after, most);
    const bool helps = read && !read->empty() && read->front().seq < events_.front().seq;
    if (helps) {
      for (EventRecord& event : *read) taken.push_back(Numbered(std::move(event)));
      return taken;
    }
    if (read || !served || !HasLeft(after)) {
      auto at = std::ranges::upper_bound(events_, after, {}, &EventRecord::seq);
      for (; at != events_.end() && taken.size() < most; ++at) taken.push_back(Numbered(*at));
      return taken;
    }
  }
  Ask(true);
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
  Wake();
}

void EventFeed::SetCursor(const std::string& consumer, Cursor cursor) {
  if (cursors_.Set(consumer, cursor)) Ask(false);
}

void EventFeed::ServeWith(std::function<void(bool now)> asked) {
  const MutexLock lock(asking_);
  asked_ = std::move(asked);
}

void EventFeed::Ask(bool now) const {
  const MutexLock lock(asking_);
  if (asked_) asked_(now);
}

bool EventFeed::IsServed() const {
  const MutexLock lock(asking_);
  return asked_ != nullptr;
}

std::int64_t EventFeed::newest() const {
  const MutexLock lock(mutex_);
  return newest_;
}

}  // namespace baudgate::events
