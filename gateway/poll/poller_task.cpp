// One task of the poller from its first request to its end: what an outcome leads to. Whether a
// reply is that to its request is in poller_order.cpp, what may be answered later in
// poller_late.cpp, what the end says about device and line in poller_status.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/poll/poller.h"
#include "gateway/poll/poller_parts.h"
#include "gateway/store/conversion.h"

namespace baudgate {
namespace {

/// A task that needs more exchanges than this is a conversation going round in circles.
constexpr int kMostSteps = 8;

/// A device that was late once is trusted again by and by: each good answer takes off this part of
/// its longer quarantine.
constexpr int kLateDecay = 64;
constexpr Duration kForgiven = 1ms;

/// A second reply shows itself behind the exchange that it spoilt, or a few later.
constexpr std::size_t kMostUnproven = 8;

/// Between two attempts to read what is read once.
constexpr Duration kLongestRepeat = 1h;
constexpr int kMostDoublings = 12;

void Forgive(Duration& lateness) {
  lateness -= lateness / kLateDecay;
  if (lateness < kForgiven) lateness = {};
}

}  // namespace

// ---------------------------------------------------------------- one task

void Poller::BeginTask(Device& device, Task task) {
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
    ChangeStatus(*work_->device, [&](DeviceStatus& status) {
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

void Poller::Send() {
  const View bytes = work_->request.bytes;
  counters_.bytes_out += bytes.size();
  echo_.OnSent(bytes);
  turns_.OnSent(IsUrgent(postponed_ ? *postponed_ : *work_));
  work_->heard = false;
  work_->safe = IsSafe(*work_);
  // What may be answered next is not that to an identification any more.
  if (work_->request.bytes != work_->device->identify) work_->device->other_seen = 0;
  work_->sent = FingerprintOf(work_->request);
  work_->device->order->OnSent(work_->sent);
  order_.OnSent(work_->sent);
  if (tap_ != nullptr) tap_->OnSent(work_->device->index, work_->request, now_);
  listener_.Send(bytes, work_->device->serial);
}

Outcome Poller::Judge(View frame, Instant now) {
  Device& device = *work_->device;
  Answer& answer = work_->answer;
  if (echo_.MayBeEcho(work_->request, frame)) {
    answer = {};
    answer.outcome = Outcome::unexpected;
    answer.reason =
        "a good reply equals its request, and this bus echoes requests: nobody need have answered; "
        "set 'echo: strip' at the line";
    return answer.outcome;
  }
  if (work_->routed) {
    answer = {};
    answer.outcome = OnRoutedFrame(frame);
    if (!device.polled()) return answer.outcome;
  } else {
    answer = device.conversation->OnFrame(work_->task, work_->request, frame, now);
  }
  if (!ProvesLife(answer.outcome) && answer.outcome != Outcome::unexpected) return answer.outcome;
  work_->heard = true;
  // The first answer to a probe tells the name that makes it the device's own.
  const auto probe = AnswerOrder::IsProbe(work_->sent) ? work_->sent : ProbeOf(device);
  const bool looks_like_probe = LooksLikeProbe(frame);
  device.order->OnAnswer(probe, looks_like_probe);
  order_.OnAnswer(probe, looks_like_probe);
  // A device that does not tell its name is probed with a read: that proves life, not the value.
  if (!work_->safe && work_->task.kind == Task::Kind::probe) answer.readings.clear();
  if (MayBeInStep(*work_) || answer.outcome != Outcome::ok) return answer.outcome;
  answer = {};
  answer.outcome = Outcome::unexpected;
  answer.reason =
      "the reply belongs to another request: the device, or a serial server before it, answers "
      "late; or it was replaced by one of another kind";
  return answer.outcome;
}

void Poller::OnEnd(ExchangeEnd end) {
  if (!work_) return;
  last_ = work_->device;
  last_->late_from.reset();
  if (end.outcome == Outcome::no_reply) last_->late_from = now_.instant;
  // The late answer to the first try was taken for that to its retry, whose own is still to come.
  if (ProvesLife(end.outcome) && work_->attempts > 0) last_->late_from = AnswerDue(*work_);
  last_->babbles = end.outcome == Outcome::corrupt;
  last_->cut_short = end.outcome == Outcome::partial;
  last_->answered = ProvesLife(end.outcome) && !last_->unanswered;
  work_->end = std::move(end);
}

void Poller::ConcludeExchange() {
  Work& work = *work_;
  Device& device = *work.device;
  if (echo_.OnExchangeEnd(work.request, *work.end)) ++counters_.collisions;
  ExchangeEnd& end = *work.end;
  if (!work.answer.reason.empty()) end.reason = work.answer.reason;
  work.mute = work.request.expect.reply == Expectation::Reply::none;
  if (!work.mute) device.health.OnExchange(end.outcome);
  if (MayStillAnswer(work, end)) {
    // Who answers in another's name has answered.
    const bool silent = end.outcome == Outcome::no_reply || work.request.expect.address.empty();
    if (silent && !device.unanswered) device.unanswered = work.exchange_began;
    // Probes of an absent device would cost the living this time again and again.
    const bool probe = work.task.kind == Task::Kind::probe && !postponed_;
    if (!probe) SetLate(device, AnswersEnd(work));
  } else if (ProvesLife(end.outcome) && !work.mute) {
    AwaitOlderAnswers();
    device.unanswered.reset();
    Forgive(device.late_drain);
    Forgive(device.trail);
  }
  // After damage, and after others' replies, an answer may still come.
  if (!work.heard && end.outcome != Outcome::line_down && !work.mute) {
    device.order->OnSilence();
    // A device that is known to be gone owes nothing, and its name would tell its late answer.
    const bool named = work.sent == AnswerOrder::Probe(device.probe_index);
    if (!(named && device.health.absent() && order_.IsInStep())) order_.OnSilence();
  }
  if (work.task.kind == Task::Kind::probe && ProvesLife(end.outcome)) device.acquainted = true;
  ChargeFailure(work);
  if (ProvesLife(end.outcome)) work.wire += now_.instant - work.exchange_began;
  CountExchange(device);
  if (!ProvesLife(end.outcome) && end.outcome != Outcome::line_down) listener_.OnNoReply();
  if (end.outcome == Outcome::line_down) {
    FinishTask(end.outcome, end.reason);
  } else if (ProvesLife(end.outcome)) {
    if (!work.mute) silent_from_.reset();
    if (work.routed) routed_at_ = now_.instant;
    Store(device);
    OnAnswered();
  } else {
    if (!silent_from_) silent_from_ = now_.instant;
    last_failure_ = now_.instant;
    OnFailed();
  }
}

void Poller::OnAnswered() {
  Work& work = *work_;
  Device& device = *work.device;
  const ExchangeEnd end = *std::exchange(work.end, std::nullopt);
  const Answer answer = std::exchange(work.answer, {});
  if (work.routed) return FinishTask(end.outcome, {});
  if (answer.wait > Duration::zero()) schedule_.Hold(device.slot, now_.instant + answer.wait);
  if (answer.then == Then::replan) {
    Plan(device);
    if (device.in_use) schedule_.Restart(device.slot, now_.instant);
    FinishTask(end.outcome, answer.reason);
  } else if (answer.then == Then::ask_again) {
    Ask();
  } else if (end.outcome == Outcome::busy && work.task.kind == Task::Kind::poll &&
             work.parkings < device.retries && !device.parked && device.in_use) {
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
  work.answer = {};
  if (work.routed) return OnRoutedFailure(end);
  const auto& command = postponed_ ? postponed_->command : work.command;
  const bool in_time = !command || now_.instant < command->deadline;
  const bool may_retry = work.attempts < device.retries &&
                         (work.task.kind != Task::Kind::probe || postponed_) &&
                         device.health.state() != DeviceState::never_seen && in_time &&
                         (command || !IsGivenUp(device));
  const bool parks = work.task.kind == Task::Kind::poll && !postponed_ && !device.parked &&
                     work.parkings < device.retries && work.request.expect.repeatable &&
                     routes_.HasShortWrite();
  if (may_retry && parks) {  // a start does not wait for the retries of a poll
    ++work.parkings;
    --work.steps;
    device.parked_until = now_.instant;
    device.parked = std::move(work_);
    return;
  }
  if (may_retry) {
    const auto instead = device.conversation->Instead(work.request, end.outcome, now_.instant);
    if (instead || work.request.expect.repeatable) {
      if (instead) work.request = *instead;
      ++work.attempts;
      work.sending = true;
      work.failure = end;
      work.failed_at = now_.instant;
      ChangeStatus(device, [](DeviceStatus& status) { ++status.retries; });
      return;
    }
  }
  EndInFailure(end);
}

void Poller::EndInFailure(const ExchangeEnd& end) {
  Device& device = *work_->device;
  const Then then =
      device.conversation->OnFailure(work_->task, work_->request, end.outcome, now_.instant);
  if (then == Then::ask_again) {
    Ask();
    return;
  }
  if (then == Then::replan) Plan(device);
  HoldBack(device);
  FinishTask(end.outcome, end.reason);
}

/// A device that went on sending long after its exchange had failed is not asked again at once
/// while others wait.
bool Poller::HasOverstayed(const Work& work) const {
  const bool poll = work.attempts > 0 && !work.command && !work.routed && !postponed_;
  return poll && now_.instant - work.failed_at > work.device->times.reply &&
         schedule_.HealthyDue(now_.instant);
}

/// Once a whole task has failed, or several devices have fallen silent together, those that answer
/// do not wait for retries.
bool Poller::IsGivenUp(const Device& device) const {
  if (!schedule_.HealthyDue(now_.instant)) return false;
  return device.health.failing() || std::ranges::count_if(devices_, [this](const auto& one) {
                                      return IsDoubted(*one) && !one->health.absent();
                                    }) > 2;
}

bool Poller::IsDoubted(const Device& device) const {
  return device.polled() && schedule_.doubted(device.slot);
}

/// What a device took in vain is charged from the first failure on; gateway/poll/poller.cpp charges
/// the time that follows.
void Poller::ChargeFailure(const Work& work) {
  Device& device = *work.device;
  if (!device.polled() || work.mute || work.end->outcome == Outcome::line_down) return;
  const bool failed = !ProvesLife(work.end->outcome);
  if (failed && !IsDoubted(device)) turns_.Charge(now_.instant - work.exchange_began);
  schedule_.Doubt(device.slot, failed);
}

void Poller::Store(Device& device) {
  std::vector<Sample> samples;
  samples.reserve(work_->answer.readings.size());
  for (const Reading& reading : work_->answer.readings) {
    if (reading.point >= device.config->points.size()) continue;
    samples.push_back(ToSample(device.config->points[reading.point], reading));
  }
  if (samples.empty()) return;
  store_.Update(device.index, samples, now_, work_->end->round_trip);
  const QueryRef read{device.slot, work_->task.query};
  const bool poll = work_->task.kind == Task::Kind::poll;
  const bool known = std::find(unproven_.begin(), unproven_.end(), read) != unproven_.end();
  if (!poll || known) return;
  if (unproven_.size() == kMostUnproven) unproven_.erase(unproven_.begin());
  unproven_.push_back(read);
}

void Poller::FinishTask(Outcome outcome, const std::string& reason) {
  const std::unique_ptr<Work> done = std::move(work_);
  Device& device = *done->device;
  if (postponed_) {
    // That it answers probes does not make up for polls that fail.
    const bool news = !ProvesLife(outcome) || device.health.state() == DeviceState::never_seen;
    if (news) UpdateHealth(device, outcome, reason);
    return ResumePostponed(outcome, reason);
  }
  if (done->budget != nullptr) probe_ = {&device, done->budget, done->began};
  if (done->group == config::Group::fast) MeasureRound(*done, outcome);
  const bool unread = !ProvesLife(outcome) || outcome == Outcome::busy;
  if (unread && IsOnce(*done)) RepeatOnce(device, outcome);
  if (!done->mute) UpdateHealth(device, outcome, reason);
  if (done->routed) return FinishRouted(*done, outcome, reason);
  if (!done->command) return;
  if (outcome == Outcome::ok && done->write < done->command->writes.size()) {
    if (done->command->deadline <= now_.instant || !device.in_use) {
      done->command->done(Outcome::no_reply,
                          device.in_use ? "the deadline passed before all points were written"
                                        : "the device was disabled before all points were written");
      return;
    }
    BeginTask(device, {});
    work_->command = std::move(done->command);
    work_->write = done->write;
    NextWrite();
  } else if (outcome == Outcome::ok && open_) {
    writes_.Confirm(std::move(*done->command));  // until what it changed has been read back
  } else {
    done->command->done(outcome, reason);
  }
}

bool Poller::IsOnce(const Work& work) const {
  if (work.group) return work.group == config::Group::once;
  const auto queries =
      work.device->polled() ? work.device->conversation->Queries() : std::span<const Query>();
  return work.refresh && work.task.query < queries.size() &&
         queries[work.task.query].group == config::Group::once;
}

/// What is read once and could not be read is tried again; after silence ever more seldom, because
/// many devices do not answer at all what they do not know.
void Poller::RepeatOnce(Device& device, Outcome outcome) {
  const Duration slow = std::min<Duration>(device.config->slow, kLongestRepeat);
  const Duration wait = slow * (1 << std::min(device.once_repeats, kMostDoublings));
  if (outcome == Outcome::no_reply) ++device.once_repeats;
  schedule_.RepeatOnce(device.slot, now_.instant + std::min<Duration>(wait, kLongestRepeat));
}

}  // namespace baudgate
