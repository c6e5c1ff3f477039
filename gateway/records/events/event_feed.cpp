// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_feed.h"

#include <algorithm>
#include <iterator>

namespace baudgate::events {

std::optional<Cursor> CursorBook::Of(const std::string& consumer) const {
  const MutexLock lock(mutex_);
  const auto found = cursors_.find(consumer);
  return found == cursors_.end() ? std::nullopt : std::optional(found->second);
}

bool CursorBook::Set(const std::string& consumer, Cursor cursor) {
  if (!consumers_.contains(consumer)) return false;
  {
    const MutexLock lock(mutex_);
    const bool was_kept = cursors_ == kept_;
    cursors_[consumer] = cursor;
    if (!was_kept || cursors_ == kept_) return false;
  }
  const MutexLock lock(telling_);
  if (due_) due_();
  return true;
}

void CursorBook::OnDue(std::function<void()> due) {
  const MutexLock lock(telling_);
  due_ = std::move(due);
}

void CursorBook::OnOpened(const Cursors& kept) {
  const MutexLock lock(mutex_);
  kept_ = kept;
  for (const auto& [name, cursor] : kept) {
    if (consumers_.contains(name)) cursors_.emplace(name, cursor);
  }
}

std::optional<Cursors> CursorBook::Due() const {
  const MutexLock lock(mutex_);
  return cursors_ == kept_ ? std::nullopt : std::optional(cursors_);
}

void CursorBook::OnKept(const Cursors& kept) {
  const MutexLock lock(mutex_);
  kept_ = kept;
}

Cursors CursorBook::all() const {
  const MutexLock lock(mutex_);
  return cursors_;
}

std::optional<std::vector<EventRecord>> Backlog::Take(std::int64_t after, std::size_t most) {
  const auto found = pages_.find(after);
  if (found == pages_.end()) {
    wanted_.insert(after);
    return std::nullopt;
  }
  std::vector<EventRecord> page = std::move(found->second);
  pages_.erase(found);
  if (page.size() > most) {
    const auto rest = page.begin() + static_cast<std::ptrdiff_t>(most);
    pages_[std::prev(rest)->seq] = {std::make_move_iterator(rest),
                                    std::make_move_iterator(page.end())};
    page.erase(rest, page.end());
  }
  return page;
}

std::optional<std::int64_t> Backlog::wanted() const {
  return wanted_.empty() ? std::nullopt : std::optional(*wanted_.begin());
}

void Backlog::Supply(std::int64_t after, std::vector<EventRecord> events) {
  wanted_.erase(after);
  if (pages_.size() == kMostPages) pages_.clear();
  pages_[after] = std::move(events);
}

namespace {

bool IsOf(const EventRecord& event, const std::string* device) {
  return device == nullptr || event.device == *device;
}

}  // namespace

void RecentEvents::Begin(FeedImage image) {
  newest_ = std::max(newest_, image.newest);
  std::ranges::move(image.events, std::back_inserter(events_));
  for (const GoneEvent& gone : image.gone) Forget(gone.seq, gone.device);
  older_ = std::move(image.older);
  Drop();
}

void RecentEvents::Add(std::vector<EventRecord> events) {
  std::ranges::move(events, std::back_inserter(events_));
  newest_ = events_.back().seq;
  Drop();
}

void RecentEvents::Forget(std::int64_t seq, const std::string& device) {
  gone_.push_back({seq, &*gone_devices_.insert(device).first});
}

void RecentEvents::Drop() {
  for (; events_.size() > limits_.events; events_.pop_front()) {
    Forget(events_.front().seq, events_.front().device);
  }
  for (; gone_.size() > limits_.remembered; gone_.pop_front()) {
    older_[*gone_.front().device] = gone_.front().seq;
  }
}

std::int64_t RecentEvents::Whole(std::uint32_t number) const {
  constexpr std::int64_t kTurn = std::int64_t{1} << 32;
  const std::int64_t whole = newest_ / kTurn * kTurn + number;
  return whole > newest_ + kTurn / 2 && whole > kTurn ? whole - kTurn : whole;
}

std::vector<EventRecord> RecentEvents::Newest(const std::string* device, std::size_t most) const {
  std::vector<EventRecord> newest;
  for (auto at = events_.rbegin(); at != events_.rend() && newest.size() < most; ++at) {
    if (IsOf(*at, device)) newest.push_back(*at);
  }
  std::ranges::reverse(newest);
  return newest;
}

std::vector<EventRecord> RecentEvents::From(std::int64_t first, const std::string* device,
                                            std::size_t most) const {
  std::vector<EventRecord> events;
  auto at = std::ranges::lower_bound(events_, first, {}, &EventRecord::seq);
  for (; at != events_.end() && events.size() < most; ++at) {
    if (IsOf(*at, device)) events.push_back(*at);
  }
  return events;
}

std::uint64_t RecentEvents::Lost(std::int64_t first, const std::string* device) const {
  const std::int64_t shown = events_.empty() ? newest_ + 1 : oldest();
  if (first >= shown) return 0;
  const std::int64_t known = gone_.empty() ? shown : gone_.front().seq;
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

/// Adds the number of the device to an event. An event of the gateway about a device counts as an
/// event of that device.
FedEvent EventFeed::Numbered(EventRecord record) const {
  const auto found = numbers_.find(record.device);
  return {found == numbers_.end() ? kGateway : found->second, std::move(record)};
}

EventFeed::Page EventFeed::Show(std::optional<Source> source, std::uint32_t first,
                                std::size_t most) const {
  Page shown;
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
