// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_feed.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace baudgate::events {
namespace {

std::int64_t NumberOf(const FedEvent& event) { return event.record.seq; }

}  // namespace

void EventFeed::Begin(FeedImage image) {
  {
    const MutexLock lock(mutex_);
    if (!events_.empty()) return;
    newest_ = std::max(newest_, image.newest);
    for (const Alarm& alarm : image.alarms) alarms_.Update(alarm);
    std::ranges::move(image.events, std::back_inserter(events_));
    gone_.assign(image.gone.begin(), image.gone.end());
    older_ = std::move(image.older);
    Drop();
  }
  Wake();
}

void EventFeed::Add(const std::vector<FedEvent>& events) {
  if (events.empty()) return;
  {
    const MutexLock lock(mutex_);
    events_.insert(events_.end(), events.begin(), events.end());
    for (const FedEvent& event : events) {
      if (event.record.alarm) alarms_.Update(*event.record.alarm);
    }
    newest_ = NumberOf(events_.back());
    Drop();
  }
  Wake();
}

void EventFeed::Move(const std::map<Source, Source>& moved) {
  const auto move = [&moved](Source& source) {
    const auto found = moved.find(source);
    if (found != moved.end()) source = found->second;
  };
  const MutexLock lock(mutex_);
  for (FedEvent& event : events_) move(event.source);
  for (GoneEvent& event : gone_) move(event.source);
  for (const auto& [was, now] : moved) {
    if (auto older = older_.extract(was)) older_[now] = older.mapped();
  }
}

void EventFeed::Drop() {
  for (; events_.size() > limits_.events; events_.pop_front()) {
    gone_.push_back({NumberOf(events_.front()), events_.front().source});
  }
  for (; gone_.size() > limits_.remembered; gone_.pop_front()) {
    older_[gone_.front().source] = gone_.front().seq;
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

std::uint64_t EventFeed::Lost(std::optional<Source> source, std::int64_t first) const {
  const std::int64_t oldest = events_.empty() ? newest_ + 1 : NumberOf(events_.front());
  const std::int64_t known = gone_.empty() ? oldest : gone_.front().seq;
  std::uint64_t lost = 0;
  if (first < known) {
    const auto older = source ? older_.find(*source) : older_.end();
    const bool had_none = source && (older == older_.end() || older->second < first);
    if (!had_none) lost = static_cast<std::uint64_t>(known - first);
  }
  const auto from = std::ranges::lower_bound(gone_, first, {}, &GoneEvent::seq);
  return lost +
         static_cast<std::uint64_t>(std::count_if(from, gone_.end(), [&](const GoneEvent& gone) {
           return !source || gone.source == *source;
         }));
}

EventFeed::Shown EventFeed::Show(std::optional<Source> source, std::uint32_t first,
                                 std::size_t most) const {
  const auto wanted = [&](const FedEvent& event) { return !source || event.source == *source; };
  Shown shown;
  const MutexLock lock(mutex_);
  shown.newest = newest_;
  if (events_.empty()) return shown;
  shown.oldest = NumberOf(events_.front());
  if (first == 0) {
    for (auto at = events_.rbegin(); at != events_.rend() && shown.events.size() < most; ++at) {
      if (wanted(*at)) shown.events.push_back(at->record);
    }
    std::ranges::reverse(shown.events);
    return shown;
  }
  const std::int64_t from = Whole(first);
  if (from < shown.oldest) shown.lost = Lost(source, from);
  auto at = std::ranges::lower_bound(events_, from, {}, NumberOf);
  for (; at != events_.end() && shown.events.size() < most; ++at) {
    if (wanted(*at)) shown.events.push_back(at->record);
  }
  return shown;
}

bool EventFeed::HasLeft(std::int64_t after) const {
  return !events_.empty() && after + 1 < NumberOf(events_.front());
}

std::vector<FedEvent> EventFeed::Take(std::int64_t after, std::size_t most) {
  const bool served = IsServed();
  {
    const MutexLock lock(mutex_);
    std::optional<std::vector<FedEvent>> read;
    if (served && HasLeft(after)) read = backlog_.Take(after, most);
    const bool helps =
        read && !read->empty() && NumberOf(read->front()) < NumberOf(events_.front());
    if (helps) return *read;
    if (read || !served || !HasLeft(after)) {
      const auto from = std::ranges::upper_bound(events_, after, {}, NumberOf);
      const auto left = static_cast<std::size_t>(events_.end() - from);
      return {from, from + static_cast<std::ptrdiff_t>(std::min(left, most))};
    }
  }
  Ask(true);
  return {};
}

std::optional<std::int64_t> EventFeed::wanted() const {
  const MutexLock lock(mutex_);
  return backlog_.wanted();
}

void EventFeed::Supply(std::int64_t after, std::vector<FedEvent> events) {
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
