// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/notice_sender.h"

#include <algorithm>

#include "gateway/base/version.h"

namespace baudgate::dds {
namespace {

/// The number of newest events that a new session gets. After a restart, as many events are
/// repeated if subscribers had not acknowledged everything.
constexpr std::uint64_t kEventImage = 1000;
constexpr std::size_t kEventsAtATime = 64;

}  // namespace

void EventSender::StartAnew() {
  placed_ = false;
  batch_.clear();
  next_ = 0;
}

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

namespace {

constexpr std::size_t kAlarmsAtATime = 64;

}  // namespace

void AlarmSender::StartAnew() {
  version_ = 0;
  batch_.clear();
  next_ = 0;
}

const AlarmSample* AlarmSender::Next() {
  if (supply_ == nullptr) return nullptr;
  if (next_ == batch_.size()) {
    batch_ = supply_->TakeAlarms(version_, kAlarmsAtATime);
    next_ = 0;
  }
  return batch_.empty() ? nullptr : &batch_[next_].sample;
}

void AlarmSender::OnSent() {
  version_ = batch_[next_].version;
  ++next_;
}

namespace {

constexpr Duration kRetry = 1s;
constexpr std::size_t kBatch = 64;
constexpr Duration kLastEvents = 700ms;  // time in which End sends the remaining events

}  // namespace

NoticeSender::NoticeSender(const config::Config& config, const bus::PointStore& store,
                           PacedWriter& paced, EventSupply* events, Now now)
    : paced_(paced),
      gateway_due_(now.instant),
      ends_(config, store),
      device_ends_(config, store),
      events_(events),
      events_due_(now.instant + kDiscoveryTime),
      meets_until_(now.instant + kMeetingTime),
      alarms_(events),
      alarms_due_(events_due_) {
  gateway_.gateway = config.name;
  gateway_.start_time_ns = now.wall.time_since_epoch().count();
  AssignBounded(gateway_.version, kVersion, kMaxVersion);
}

void NoticeSender::StartAnew(Instant now, bool same) {
  if (!same) {
    ends_.Clear();
    device_ends_.Clear();
    gateway_due_ = now;
  }
  events_.StartAnew();
  alarms_.StartAnew();
  alarms_due_ = events_due_ = now + kDiscoveryTime;
  meets_until_ = now + kMeetingTime;
}

Instant NoticeSender::EventsDue() const {
  return paced_.EventsAreRead() ? events_due_ : std::max(events_due_, meets_until_);
}

bool NoticeSender::Send(Instant now) {
  return SendGateway(now) && SendFrom(ends_, ends_due_, now) &&
         SendFrom(device_ends_, ends_due_, now) &&
         (now < EventsDue() || SendFrom(events_, events_due_, now)) &&
         SendFrom(alarms_, alarms_due_, now);
}

/// Sends the sample of the gateway if it is due. False: PacedWriter accepts no sample now.
bool NoticeSender::SendGateway(Instant now) {
  if (now < gateway_due_) return true;
  if (!paced_.MayWrite(now)) return false;
  const Sent sent = paced_.Write(gateway_, now);
  if (sent == Sent::later) return false;
  gateway_due_ = sent == Sent::yes ? Instant::max() : now + kRetry;
  return true;
}

/// Sends at most kBatch samples of `sender`. False: PacedWriter accepts no sample now. The order is
/// preserved, so a refused sample delays the following samples until its retry.
template <typename Sender>
bool NoticeSender::SendFrom(Sender& sender, Instant& due, Instant now) {
  if (now < due) return true;
  for (std::size_t count = 0; count < kBatch; ++count) {
    const auto* sample = sender.Next();
    if (sample == nullptr) return true;
    if (!paced_.MayWrite(now)) return false;
    const Sent sent = paced_.Write(*sample, now);
    if (sent == Sent::later) return false;
    if (sent == Sent::refused) {
      due = now + kRetry;
      return true;
    }
    sender.OnSent();
  }
  return true;
}

Instant NoticeSender::Due() {
  const Instant ends = EndsAreTold() ? Instant::max() : ends_due_;
  const Instant events = events_.Next() == nullptr ? Instant::max() : EventsDue();
  const Instant alarms = alarms_.Next() == nullptr ? Instant::max() : alarms_due_;
  return std::min({gateway_due_, ends, events, alarms});
}

std::optional<Instant> NoticeSender::End(Instant now) {
  if (!end_by_) end_by_ = now + kLastEvents;
  if (const auto next = EndOf(events_, now)) return next;
  return EndOf(alarms_, now);
}

/// Sends the remaining samples of `sender`. Returns the time of the next call; nothing: all samples
/// were sent, or they cannot be sent.
template <typename Sender>
std::optional<Instant> NoticeSender::EndOf(Sender& sender, Instant now) {
  while (const auto* sample = sender.Next()) {
    if (now >= *end_by_) return std::nullopt;
    if (!paced_.MayWrite(now)) return paced_.ReadyAt();
    const Sent sent = paced_.Write(*sample, now);
    if (sent == Sent::later) return paced_.ReadyAt();
    if (sent == Sent::refused) return std::nullopt;
    sender.OnSent();
  }
  return std::nullopt;
}

}  // namespace baudgate::dds
