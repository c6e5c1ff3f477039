// What the poller chooses when the line is idle: short routed writes, writes to points and their
// read-back, probes, polls, routed requests. gateway/poll/poller.cpp asks, poller_task.cpp carries
// out.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/poll/poller.h"
#include "gateway/poll/poller_parts.h"

namespace baudgate {
namespace {

/// Clients of transparent routes that poll do so at least this often.
constexpr Duration kClientsReturn = 2s;

/// Who has asked for an absent slave wants to know of its return for so long.
constexpr Duration kStillWanted = 1min;

}  // namespace

Turns::Waiting Poller::Waiting() const {
  if (routes_.empty()) return {};
  return {.short_write = routes_.HasShortWrite(),
          .routed = true,
          .high_clients = routes_.Clients(config::Priority::high)};
}

bool Poller::PickTask() {
  const Turns::Waiting waiting = Waiting();
  for (const Turns::Choice choice : turns_.Order(waiting)) {
    if (!Pick(choice)) continue;
    turns_.OnTaken(choice, waiting);
    return true;
  }
  turns_.OnNothing();
  return false;
}

bool Poller::Pick(Turns::Choice choice) {
  using Choice = Turns::Choice;
  switch (choice) {
    case Choice::urgent:
      return PickUrgent();
    case Choice::parked:
      return PickParked();
    case Choice::probe:
      return PickProbe();
    case Choice::poll:
      return PickPoll();
    case Choice::routed_high:
      return PickRouted(config::Priority::high);
    case Choice::routed_normal:
      return PickRouted(config::Priority::normal);
    case Choice::routed_low:
      return PickRouted(config::Priority::low);
  }
  return false;
}

bool Poller::IsUrgent(const Work& work) const {
  if (work.command || work.refresh) return true;
  return work.routed && !work.routed->empty() && RouteQueue::IsShortWrite(work.routed->front());
}

bool Poller::PickUrgent() {
  const auto may_ask = [this](const RoutedRequest& request) { return MayAsk(request); };
  if (!routes_.empty() && StartRouted(routes_.TakeUrgent(may_ask))) return true;
  if (!routes_.empty() && PickWriteProbe()) return true;
  // Who has written waits for the read-back, too.
  return PickRefresh() || PickCommand();
}

bool Poller::PickWriteProbe() {
  for (const std::uint8_t slave : routes_.Slaves()) {
    const Device* device = FindSlave(slave);
    if (device == nullptr || !device->health.absent() || device->late_until > now_.instant)
      continue;
    if (NextWriteProbe(*device) > now_.instant) return false;
    const auto to_it = [slave](const RoutedRequest& request) { return request.slave == slave; };
    if (!StartRouted(routes_.TakeUrgent(to_it))) continue;
    ++counters_.probes;
    work_->budget = &write_probes_;
    return true;
  }
  return false;
}

/// It goes as soon as the share allows it, whatever else there is: who sends it waits for nothing
/// else.
Instant Poller::NextWriteProbe(const Device& device) const {
  const auto free =
      write_probes_.NextProbe(now_.instant, NextWanted(), idle_since_, device.WorstCase());
  return free.value_or(std::max(now_.instant, write_probes_.earned_at()));
}

bool Poller::PickParked() {
  for (const auto& device : devices_) {
    if (!device->parked || device->parked_until > now_.instant) continue;
    work_ = std::move(device->parked);
    Ask();
    return true;
  }
  return false;
}

bool Poller::PickPoll() {
  const auto pick = schedule_.Next(now_.instant, turns_.HealthyFirst());
  if (!pick) return false;
  Device& device = *devices_[pick->device];
  BeginTask(device, {Task::Kind::poll, pick->query, kNoPoint, {}});
  work_->group = pick->group;
  work_->last_of_round = pick->last_of_round;
  Ask();
  return true;
}

/// Whether anybody wants to know if an absent device is back.
bool Poller::Wanted(const Device& device) const {
  if (device.polled() && device.in_use) return device.health.absent();
  if (device.slave == 0) return false;
  return routes_.HasFor(device.slave) || MayRepeatRead(device);
}

/// Soon after it was asked for; later only behind an exchange, where whoever asks next waits least
/// for it.
bool Poller::MayRepeatRead(const Device& device) const {
  if (device.refused_read.empty()) return false;
  const bool behind = idle_since_ == now_.instant;
  return now_.instant - device.refused_at < (behind ? kStillWanted : kClientsReturn);
}

Poller::Device* Poller::Absent(std::size_t turn) const {
  for (std::size_t i = 0; i < everyone_.size(); ++i) {
    Device* device = everyone_[(turn + i) % everyone_.size()];
    const bool clear = device->late_until <= now_.instant;
    if (device->health.absent() && clear && Wanted(*device)) return device;
  }
  return nullptr;
}

/// When the first absent device may be probed whose late answer is still waited for.
std::optional<Instant> Poller::NextClear() const {
  std::optional<Instant> soonest;
  for (const Device* device : everyone_) {
    if (device->late_until <= now_.instant || !device->health.absent()) continue;
    if (!Wanted(*device)) continue;
    soonest = std::min(soonest.value_or(device->late_until), device->late_until);
  }
  return soonest;
}

/// When somebody who answers wants the line again. Clients do not say when they will: who has just
/// been served may be back at any moment.
std::optional<Instant> Poller::NextWanted() const {
  if (routed_at_ && now_.instant - *routed_at_ < kClientsReturn) return now_.instant;
  return RoutedWaits() ? now_.instant : schedule_.NextDue();
}

std::optional<Instant> Poller::NextProbe() const {
  const Device* device = Absent(probe_turn_);
  if (device == nullptr) return NextClear();
  const auto when = probes_.NextProbe(now_.instant, NextWanted(), idle_since_, device->WorstCase());
  if (when) return when;
  // Who waits for its answer is there now, and may not be when the line next becomes idle.
  if (routes_.HasFor(device->slave)) return std::max(now_.instant, probes_.earned_at());
  if (!routed_at_) return when;
  // Once the clients have stayed away for so long, the line counts as free.
  const Instant free = *routed_at_ + kClientsReturn;
  return free > now_.instant ? std::optional(free) : std::nullopt;
}

/// Somebody waits for a slave that answers.
bool Poller::RoutedWaits() const {
  return routes_.HasAny([this](const RoutedRequest& request) { return MayAsk(request); });
}

bool Poller::PickProbe() {
  const auto when = NextProbe();
  if (!when || *when > now_.instant) return false;
  Device* device = Absent(probe_turn_);
  const auto place = std::ranges::find(everyone_, device) - everyone_.begin();
  probe_turn_ = static_cast<std::size_t>(place) + 1;
  if (device->polled() && device->in_use) {
    BeginTask(*device, {Task::Kind::probe, 0, kNoPoint, {}});
    Ask();
  } else if (!StartRouted(routes_.TakeFor(device->slave)) && !RepeatRead(*device)) {
    return false;
  }
  ++counters_.probes;
  if (work_) work_->budget = &probes_;
  return true;
}

/// How long the living had to wait for a probe that took the line from `from` to `to`.
Duration Poller::Waited(Instant from, Instant to) const {
  if (!writes_.empty() || RoutedWaits()) return to - from;
  const auto due = schedule_.NextDue();
  if (!due || *due >= to) return Duration::zero();
  return to - std::max(from, *due);
}

}  // namespace baudgate
