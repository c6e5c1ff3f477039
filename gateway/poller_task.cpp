// One task of the poller from its first request to its end: what an outcome leads to, and what it
// says about the device.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/conversion.h"
#include "gateway/poller.h"
#include "gateway/poller_parts.h"

namespace baudgate {
namespace {

/// A task that needs more exchanges than this is a conversation going round in circles.
constexpr int kMostSteps = 8;

/// A device that was late once is trusted again by and by: each good answer takes off this part of
/// its longer quarantine.
constexpr int kLateDecay = 64;

}  // namespace

// ---------------------------------------------------------------- one task

void Poller::Begin(Device& device, Task task) {
  work_ = std::make_unique<Work>();
  work_->device = &device;
  work_->task = std::move(task);
  work_->began = now_.instant;
}

void Poller::Ask() {
  if (++work_->steps > kMostSteps) {
    FinishTask(Outcome::unexpected, "the conversation did not come to an end");
    return;
  }
  auto request = work_->device->conversation->Ask(work_->task, now_.instant);
  if (!request) {
    work_->mute = true;
    store_.UpdateStatus(work_->device->index, [&](DeviceStatus& status) {
      status.last_outcome = Outcome::unsupported;
      status.last_reason = request.error();
    });
    FinishTask(Outcome::unsupported, request.error());
    return;
  }
  work_->request = std::move(*request);
  work_->attempts = 0;
  work_->sending = true;
}

void Poller::Send(View bytes) {
  counters_.bytes_out += bytes.size();
  listener_.Send(bytes, work_->device->serial);
}

Outcome Poller::OnFrame(View frame, Instant now) {
  work_->answer = work_->device->conversation->OnFrame(work_->task, work_->request, frame, now);
  return work_->answer.outcome;
}

void Poller::OnExchangeEnd(const ExchangeEnd& end, Instant) {
  if (work_) work_->end = end;
}

void Poller::OnStrayBytes(std::size_t count, Duration since_end, Instant) {
  counters_.stray_bytes += count;
  if (last_ == nullptr) return;
  // A late answer, or the rest of one: this device gets a longer quarantine from now on.
  Device& device = *last_;
  if (since_end > device.times.ceiling) return;  // too late for any answer: noise
  const Duration needed = std::min(since_end + device.times.gap, device.times.ceiling);
  if (needed <= device.times.drain + device.late_drain) return;
  if (!std::exchange(device.told_late, true)) {
    listener_.OnWarning(
        device.index, "bytes came " +
                          FormatDuration(std::chrono::round<std::chrono::milliseconds>(since_end)) +
                          " after its exchange had ended; if this goes on, raise timing.reply");
  }
  device.late_drain = needed - device.times.drain;
}

void Poller::ConcludeExchange() {
  Work& work = *work_;
  Device& device = *work.device;
  const ExchangeEnd& end = *work.end;
  const std::string reason = work.answer.reason.empty() ? end.reason : work.answer.reason;
  counters_.busy += now_.instant - work.exchange_began;
  work.mute = work.request.expect.reply == Expectation::Reply::none;
  if (!work.mute) device.health.OnExchange(end.outcome);
  // An unexpected frame may be another device's late answer: then this device's own is still to
  // come.
  if (end.outcome == Outcome::no_reply || end.outcome == Outcome::unexpected) {
    if (!device.unanswered) device.unanswered = work.exchange_began;
    // Probes of an absent device would cost the living this time again and again.
    const bool probe = work.task.kind == Task::Kind::probe;
    if (!probe) device.late_until = now_.instant + device.times.ceiling - device.times.reply;
  } else if (ProvesLife(end.outcome) && !work.mute) {
    device.unanswered.reset();
    device.late_until = {};  // the aftermath of the answer took care
    device.late_drain -= device.late_drain / kLateDecay;
  }
  Count(device, reason);
  listener_.OnExchangeEnd(device.index, end.outcome);
  if (end.outcome == Outcome::line_down) {
    FinishTask(end.outcome, reason);
  } else if (ProvesLife(end.outcome)) {
    if (!work.mute) last_life_ = now_.instant;
    Store(device);
    OnAnswered();
  } else {
    OnFailed();
  }
}

void Poller::OnAnswered() {
  Work& work = *work_;
  Device& device = *work.device;
  const ExchangeEnd end = *std::exchange(work.end, std::nullopt);
  const Answer answer = std::exchange(work.answer, {});
  if (answer.wait > Duration::zero()) schedule_.Hold(device.slot, now_.instant + answer.wait);
  if (answer.then == Then::replan) {
    Plan(device);
    schedule_.Restart(device.slot, now_.instant);
    FinishTask(end.outcome, answer.reason);
  } else if (answer.then == Then::ask_again) {
    Ask();
  } else if (end.outcome == Outcome::busy && work.task.kind == Task::Kind::poll &&
             work.parkings < device.retries && !device.parked) {
    ++work.parkings;
    --work.steps;
    device.parked_until = now_.instant + std::max<Duration>(answer.wait, device.times.quiet);
    schedule_.Hold(device.slot, device.parked_until);
    device.parked = std::move(work_);
  } else {
    FinishTask(end.outcome, answer.reason);
  }
}

void Poller::OnFailed() {
  Work& work = *work_;
  Device& device = *work.device;
  const ExchangeEnd end = *std::exchange(work.end, std::nullopt);
  const Answer answer = std::exchange(work.answer, {});
  const bool in_time = !work.command || now_.instant < work.command->deadline;
  const bool may_retry = work.attempts < device.retries && work.task.kind != Task::Kind::probe &&
                         device.health.state() != DeviceState::never_seen && in_time;
  if (may_retry) {
    const auto instead = device.conversation->Instead(work.request, end.outcome, now_.instant);
    if (instead || work.request.expect.repeatable) {
      if (instead) work.request = *instead;
      ++work.attempts;
      work.sending = true;
      store_.UpdateStatus(device.index, [](DeviceStatus& status) { ++status.retries; });
      return;
    }
  }
  const Then then =
      device.conversation->OnFailure(work.task, work.request, end.outcome, now_.instant);
  if (then == Then::ask_again) {
    Ask();
    return;
  }
  if (then == Then::replan) Plan(device);
  schedule_.Hold(device.slot, device.late_until);
  FinishTask(end.outcome, answer.reason.empty() ? end.reason : answer.reason);
}

void Poller::Store(Device& device) {
  std::vector<Sample> samples;
  samples.reserve(work_->answer.readings.size());
  for (const Reading& reading : work_->answer.readings) {
    if (reading.point >= device.config->points.size()) continue;
    samples.push_back(ToSample(device.config->points[reading.point], reading));
  }
  if (!samples.empty()) store_.Update(device.index, samples, now_, work_->end->round_trip);
}

void Poller::FinishTask(Outcome outcome, const std::string& reason) {
  const std::unique_ptr<Work> done = std::move(work_);
  Device& device = *done->device;
  if (done->task.kind == Task::Kind::probe) {
    const Duration drain = NeedsDrain(outcome) ? device.times.drain + device.late_drain : 0s;
    probes_.OnProbe(done->began, now_.instant + drain, Waiting(now_.instant + drain));
  }
  if (done->fast) MeasureRound(*done, outcome);
  if (!done->mute) UpdateHealth(device, outcome, reason);
  if (!done->command) return;
  if (outcome == Outcome::ok && done->write < done->command->writes.size()) {
    if (done->command->deadline <= now_.instant) {
      done->command->done(Outcome::no_reply, "the deadline passed before all points were written");
      return;
    }
    Begin(device, {});
    work_->command = std::move(done->command);
    work_->write = done->write;
    NextWrite();
  } else if (outcome == Outcome::ok && open_) {
    confirmed_.push_back(std::move(*done->command));  // until what it changed has been read back
  } else {
    done->command->done(outcome, reason);
  }
}

/// The writes of the command before work_->write are confirmed: goes on with the next.
void Poller::NextWrite() {
  Work& work = *work_;
  Device& device = *work.device;
  const PointWrite& write = work.command->writes[work.write++];
  auto raw = ToRaw(device.config->points[write.point], write.value);
  work.task.kind = Task::Kind::write;
  work.task.point = write.point;
  if (!raw) {
    FinishTask(Outcome::refused, raw.error());
    return;
  }
  work.task.value = std::move(*raw);
  const auto queries = device.conversation->Queries();
  for (std::size_t query = 0; query < queries.size(); ++query) {
    const auto& points = queries[query].points;
    if (std::find(points.begin(), points.end(), write.point) == points.end()) continue;
    const std::pair wanted(&device, query);
    const bool known = std::find(refresh_.begin(), refresh_.end(), wanted) != refresh_.end();
    if (!known && refresh_.size() < kQueueLimit) refresh_.push_back(wanted);
  }
  Ask();
}

// ---------------------------------------------------------------- device state

Override Poller::OverrideOf(const Device& device) const {
  if (!device.config->enabled) return Override::out_of_service;
  if (!open_) return Override::not_connected;
  return device.health.offline() ? Override::offline : Override::none;
}

void Poller::UpdateHealth(Device& device, Outcome outcome, const std::string& reason) {
  const bool was_absent = device.health.absent();
  device.health.OnTask(outcome, now_.instant);
  if (device.health.absent() && !was_absent) {
    schedule_.Suspend(device.slot);
    device.parked.reset();
    device.fast_wire = device.round_wire = {};
    device
        .late_drain = {};  // silent, not late; should it be late even so, its bytes will tell again
    device.conversation->OnReconnect();
    Plan(device);
  } else if (!device.health.absent() && was_absent) {
    schedule_.Restart(device.slot, now_.instant);
  }
  ShowState(device, reason.empty() ? std::string(Name(outcome)) : reason);
  store_.SetOverride(device.index, OverrideOf(device));
}

void Poller::ShowState(Device& device, const std::string& reason) {
  const DeviceState state = device.health.state();
  if (state == device.shown) return;
  const DeviceState from = std::exchange(device.shown, state);
  store_.UpdateStatus(device.index, [&](DeviceStatus& status) { status.state = state; });
  listener_.OnDeviceState(device.index, from, state, reason);
}

void Poller::Count(Device& device, const std::string& reason) {
  ++counters_.exchanges;
  const ExchangeEnd& end = *work_->end;
  const std::uint32_t missed = schedule_.missed(device.slot);
  store_.UpdateStatus(device.index, [&](DeviceStatus& status) {
    ++status.exchanges;
    ++status.outcomes[static_cast<std::size_t>(end.outcome)];
    status.last_outcome = end.outcome;
    status.missed = missed;
    if (end.outcome != Outcome::ok) status.last_reason = reason;
    if (ProvesLife(end.outcome) && !work_->mute) {
      status.last_ok = now_.instant;
      status.last_ok_wall = now_.wall;
      status.round_trips.Add(end.round_trip);
    }
  });
}

/// Failures and retries say nothing about how long a round takes: an outage must not make old
/// values look younger.
void Poller::MeasureRound(const Work& work, Outcome outcome) {
  Device& device = *work.device;
  device.round_wire += now_.instant - work.began;
  device.round_clean = device.round_clean && ProvesLife(outcome);
  if (!work.last_of_round) return;
  const Duration took = std::exchange(device.round_wire, {});
  if (!std::exchange(device.round_clean, true)) return;
  device.fast_wire = took;
  MeasureCycle();
}

void Poller::MeasureCycle() {
  Duration cycle{};
  for (const auto& device : devices_) cycle += device->fast_wire;
  for (const auto& device : devices_) store_.SetLineCycle(device->index, cycle);
}

void Poller::Plan(Device& device) {
  std::vector<config::Group> groups;
  for (const Query& query : device.conversation->Queries()) groups.push_back(query.group);
  schedule_.SetQueries(device.slot, std::move(groups));
  device.parked.reset();  // its query may be another one now
}

}  // namespace baudgate
