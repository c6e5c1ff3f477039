// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/recent_events.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace baudgate::events {
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

}  // namespace baudgate::events
