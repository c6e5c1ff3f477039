// What the poller says about its devices and its line: states, counters, measured times.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>
#include <utility>

#include "gateway/poll/poller.h"
#include "gateway/poll/poller_parts.h"

namespace baudgate {
namespace {

/// Line use is not worth a word before.
constexpr Duration kShortestUse = 10s;

}  // namespace

Override Poller::OverrideOf(const Device& device) const {
  if (!device.in_use) return Override::out_of_service;
  if (!open_) return closed_as_;
  return device.health.offline() ? Override::offline : Override::none;
}

DeviceState Poller::StateOf(const Device& device) const {
  if (!device.in_use) return DeviceState::disabled;
  const DeviceState state = device.health.state();
  return open_ || state == DeviceState::never_seen ? state : DeviceState::offline;
}

/// A slave that only routes reach stands in no store.
void Poller::ChangeStatus(const Device& device, const std::function<void(DeviceStatus&)>& change) {
  if (device.polled()) store_.UpdateStatus(device.index, change);
}

void Poller::ShowOverride(const Device& device) {
  if (device.polled()) store_.SetOverride(device.index, OverrideOf(device));
}

void Poller::UpdateHealth(Device& device, Outcome outcome, const std::string& reason) {
  const bool was_absent = device.health.absent();
  device.health.OnTask(outcome, now_.instant);
  if (device.health.absent() && !was_absent) {
    ChangeStatus(device, [](DeviceStatus& status) { status.recent = {}; });
    device.parked.reset();
    device.late_drain = {};  // silent, not late; its bytes will tell should it be late even so
    device.probe_wait.reset();
    device.probed_at.reset();
    device.probe_gap = {};
    if (device.polled()) {
      schedule_.Suspend(device.slot);
      Reconnect(device);
    }
  } else if (!device.health.absent() && was_absent && device.in_use && device.polled()) {
    schedule_.Restart(device.slot, now_.instant);
  }
  if (device.health.absent() != was_absent) {
    MeasureCycle();
    ShowLine();
  }
  const std::string_view why =
      outcome == Outcome::ok ? "some of its exchanges fail" : Name(outcome);
  ShowState(device, reason.empty() ? std::string(why) : reason);
  ShowOverride(device);
}

void Poller::ShowState(Device& device, const std::string& reason) {
  const DeviceState state = StateOf(device);
  if (state == device.shown) return;
  const DeviceState from = std::exchange(device.shown, state);
  ChangeStatus(device, [&](DeviceStatus& status) { status.state = state; });
  listener_.OnDeviceState(device.index, from, state, reason);
  if (tap_ != nullptr) tap_->OnDeviceState(device.index, state, reason, now_);
}

/// Of those, too, who have not been asked for long.
void Poller::CountMissed() {
  for (const auto& device : devices_) {
    const std::uint32_t missed = schedule_.Missed(device->slot, now_.instant);
    if (std::exchange(device->missed, missed) == missed) continue;
    ChangeStatus(*device, [missed](DeviceStatus& status) { status.missed = missed; });
  }
}

void Poller::CountExchange(Device& device) {
  const ExchangeEnd& end = *work_->end;
  const bool answered = ProvesLife(end.outcome) && !work_->mute;
  CountMissed();
  const bool probe = device.health.absent() && work_->task.kind == Task::Kind::probe;
  ++counters_.exchanges;
  ++counters_.outcomes[static_cast<std::size_t>(end.outcome)];
  if (answered) counters_.round_trips.Add(end.round_trip);
  ChangeStatus(device, [&](DeviceStatus& status) {
    ++status.exchanges;
    ++status.outcomes[static_cast<std::size_t>(end.outcome)];
    status.last_outcome = end.outcome;
    if (!probe) status.recent.Add(end.outcome);
    status.busy = device.busy;
    if (end.outcome != Outcome::ok) status.last_reason = end.reason;
    if (!answered) return;
    status.last_ok = now_.instant;
    status.last_ok_wall = now_.wall;
    status.round_trips.Add(end.round_trip);
  });
  ShowLine();
  if (tap_ != nullptr) tap_->OnExchangeEnd(device.index, end, now_);
}

void Poller::CountLate(Device& device, Duration since_end) {
  ++counters_.late;
  ChangeStatus(device, [&](DeviceStatus& status) {
    ++status.late;
    status.lateness = since_end;
  });
  ShowLine();
}

/// What the line was busy with of the minute under way.
double Poller::UseSince(Instant began) const {
  const Duration whole = now_.instant - began;
  if (whole < kShortestUse) return 0;
  return static_cast<double>((counters_.busy - busy_before_minute_).count()) /
         static_cast<double>(whole.count());
}

void Poller::ShowLine() {
  const Duration bound = NoticeBound();
  store_.UpdateLine(line_index_, [&](LineStatus& status) {
    static_cast<LineCounters&>(status) = counters_;
    status.use = use_ ? *use_ : UseSince(minute_began_);
    status.notice_bound = bound;
  });
}

/// One turn of all absent devices: each costs its worst case and the pause, or as long as it takes
/// to earn the time that the living waited for its last probe; a probe that makes them wait is sent
/// behind an exchange of theirs only, hence the longest of their periods once. Where the polls
/// leave too little room even so, the turn that was seen counts. A share that is used up has to be
/// earned first.
Duration Poller::NoticeBound() const {
  Duration turn{};
  Duration period{};
  Duration seen{};
  std::optional<Duration> known;  // the longest wait for any of them
  for (const Device* device : everyone_) {
    if (device->in_use && device->health.absent()) known = std::max(known, device->probe_wait);
  }
  for (const Device* device : everyone_) {
    if (!device->in_use) continue;
    if (device->health.absent()) {
      const Duration worst = device->WorstCase();
      turn += ProbeBudget::Interval(worst, device->probe_wait.value_or(known.value_or(worst)));
      seen = std::max(seen, device->probe_gap + worst);
    } else if (device->polled()) {
      period = std::max(period, device->config->poll);
    }
  }
  if (turn == Duration::zero()) return turn;
  const Duration blocked = std::max<Duration>(probes_.earned_at() - now_.instant, {});
  return std::max(blocked + turn + period, seen);
}

/// Failures, retries and waiting say nothing about how long a round takes: an outage must not make
/// old values look younger.
void Poller::MeasureRound(const Work& work, Outcome outcome) {
  Device& device = *work.device;
  device.round_wire += work.wire;
  device.round_clean = device.round_clean && ProvesLife(outcome);
  if (!work.last_of_round) return;
  const Duration took = std::exchange(device.round_wire, {});
  if (!std::exchange(device.round_clean, true)) return;
  device.fast_wire = took;
  MeasureCycle();
}

void Poller::MeasureCycle() {
  Duration cycle{};
  for (const auto& device : devices_) {
    if (device->in_use && !device->health.absent()) cycle += device->fast_wire;
  }
  for (const auto& device : devices_) store_.SetLineCycle(device->index, cycle, now_.instant);
}

/// Nothing that was learned of the device holds any more: it may be another one. What it has said
/// is not good again before it says it again.
void Poller::Reconnect(Device& device) {
  device.conversation->OnReconnect();
  Plan(device);
  device.once_repeats = 0;
  std::vector<std::size_t> points(device.config->points.size());
  std::iota(points.begin(), points.end(), 0U);
  store_.Doubt(device.index, points, now_.instant);
}

void Poller::Plan(Device& device) {
  std::vector<config::Group> groups;
  for (const Query& query : device.conversation->Queries()) groups.push_back(query.group);
  schedule_.SetQueries(device.slot, std::move(groups));
  device.parked.reset();  // its query may be another one now
  device.round_wire = {};
  device.round_clean = true;
}

}  // namespace baudgate
