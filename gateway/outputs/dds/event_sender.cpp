// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/event_sender.h"

#include <algorithm>

namespace baudgate::dds {
namespace {

constexpr std::size_t kEventsAtATime = 64;

}  // namespace

void EventSender::StartAnew() {
  placed_ = false;
  batch_.clear();
  next_ = 0;
}

/// False: the file has not been read yet.
bool EventSender::FindPlace() {
  const std::uint64_t newest = supply_->newest();
  if (newest == 0) return false;
  const auto before = [](std::uint64_t seq) { return seq > kEventImage ? seq - kEventImage : 0; };
  const auto kept = ever_ ? std::nullopt : supply_->place();
  if (kept) reached_ = std::min(kept->seq, newest);
  if (kept && kept->sure) {
    place_ = reached_;
  } else {
    place_ = before(ever_ || kept ? reached_ : newest);
  }
  reached_ = std::max(reached_, place_);
  placed_ = ever_ = true;
  return true;
}

bool EventSender::Load() {
  batch_ = supply_->Take(place_, kEventsAtATime);
  next_ = 0;
  if (batch_.empty()) return false;
  const std::uint64_t first = batch_.front().seq;
  if (first > reached_ + 1) skipped_ += first - reached_ - 1;
  return true;
}

const EventSample* EventSender::Next() {
  if (supply_ == nullptr || (!placed_ && !FindPlace())) return nullptr;
  for (;;) {
    if (next_ == batch_.size() && !Load()) return nullptr;
    const EventSample& event = batch_[next_];
    if (!event.gateway.empty()) return &event;
    GoTo(event.seq);
  }
}

void EventSender::GoTo(std::uint64_t seq) {
  place_ = seq;
  reached_ = std::max(reached_, seq);
  ++next_;
  supply_->Keep({reached_, false});
}

void EventSender::OnSent() {
  GoTo(batch_[next_].seq);
  ++sent_;
}

void EventSender::Confirm() {
  if (ever_ && place_ == reached_) supply_->Keep({reached_, true});
}

}  // namespace baudgate::dds
