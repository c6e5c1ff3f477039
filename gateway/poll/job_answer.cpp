// What an exchange leads to: the next request, the same one again, or the end of the job. The table
// of all its states is in job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/poll/job_run.h"

namespace baudgate {
namespace {

bool IsReading(const Job& job) {
  return job.task.kind == Task::Kind::poll && !job.attempt.answer.readings.empty();
}

/// The request was a broadcast: there was no answer, and none is due.
bool GoesOnBehindBroadcast(Job& job, Instant now) {
  if (!job.is_broadcast() || job.As<Job::Routed>() != nullptr) return false;
  Conversation& conversation = *job.member->device->conversation;
  if (conversation.OnSent(job.task, job.step.request, now) != Then::ask_again) return false;
  ++job.broadcasts;
  return true;
}

}  // namespace

void JobRun::OnEnd(ExchangeEnd end) {
  owed_.late.OnEnd(job_->asked(), end.outcome, now_.instant);
  job_->attempt.end = std::move(end);
}

std::optional<ExchangeEnd> JobRun::TakeEnd() {
  return job_ ? std::exchange(job_->attempt.end, std::nullopt) : std::nullopt;
}

void JobRun::Conclude(ExchangeEnd end, const Finding& finding) {
  Job& job = *job_;
  const bool cut_off = end.outcome == Outcome::line_down;
  if (!cut_off && !job.attempt.answer.reason.empty()) end.reason = job.attempt.answer.reason;
  job.judges_member = !job.is_broadcast();
  const bool answered = ProvesLife(end.outcome);
  upkeep_.OnExchange(job, end, finding, now_.instant);
  if (answered) job.wire += now_.instant - job.attempt.began;
  if (cut_off) return Finish(end.outcome, end.reason);
  if (answered && GoesOnBehindBroadcast(job, now_.instant)) return Ask(job.step.retries);
  answered ? OnAnswered(end) : OnFailed(end);
}

/// * A read is repeated while its reply may answer a much older one.
/// * A probe is repeated until its reply cannot answer the probe of an earlier task. Through a
///   server that lags, two tasks may differ by one probe only.
/// * Another device may have answered a repetition, so events wait for a probe, if the device has a
///   name.
/// * Else the answer is taken.
void JobRun::OnAnswered(const ExchangeEnd& end) {
  Job& job = *job_;
  if (job.As<Job::Routed>() != nullptr) return OnRoutedAnswer(end);
  Device& device = *job.member->device;
  Job::Attempt& attempt = job.attempt;
  attempt.answered_at = {now_.instant - end.since_reply, now_.wall - end.since_reply};
  attempt.round_trip = end.round_trip;
  attempt.late = LateAnswers::Lateness(job.asked(), end) > Duration::zero();
  if (attempt.verdict.replaced) {
    effects_.OnReplaced(device, now_);
    if (job.postponed) job.postponed->attempt.answer = {};
  }
  const bool reads = IsReading(job) && job.step.request.expect.repeatable;
  const bool lags = owed_.whose.Lags(*job.member);
  const bool much_older = lags && attempt.verdict.older > job.member->times.ceiling;
  const bool reads_again =
      reads && much_older && chooser_.MayRepeat(job, kMostTriesMore, now_.instant);
  const bool wants_peace =
      attempt.answer.outcome == Outcome::busy || attempt.answer.wait > Duration::zero();
  const bool may_be_of_earlier_probe =
      job.postponed && !owed_.whose.orders().IsOfLatest(job.asked());
  const bool probes_again = may_be_of_earlier_probe && !wants_peace &&
                            chooser_.MayRepeat(job, kMostProbesMore, now_.instant);
  if (reads_again || probes_again) {
    ++job.step.retries;
    job.step.waiting = true;
  } else if (job.has_news() && (job.had_failure || job.step.retries > 0) &&
             owed_.whose.HasName(*job.member)) {
    PutProbeFirst();
  } else {
    TakeAnswer();
  }
}

/// A reply that seemed lost may come in place of the next one. So a read is repeated until its
/// reply must be its own: after n lost replies, that is reply n + 1 to the same request. Example
/// with one:
///
///   03 3BCA 0002    03 04 …    may be that to 03 3BC5 0002
///   03 3BCA 0002    03 04 …    is one to 03 3BCA 0002
void JobRun::OnRoutedAnswer(const ExchangeEnd& end) {
  Job& job = *job_;
  Job::Routed& routed = *job.As<Job::Routed>();
  Member& member = *job.member;
  agenda_.routes.OnAnswered(now_.instant);
  const bool own = member.device != nullptr
                       ? job.attempt.verdict.proven || routed.odd
                       : owed_.whose.lost().OnReply(member, job.step.request.bytes, routed.older,
                                                    ++routed.replies);
  if (own) return Finish(end.outcome, {});
  if (routed.is_read && job.step.retries < kMostTriesMore) {
    ++job.step.retries;
    job.step.waiting = true;
    return ledger_.devices.OnRetry(member);
  }
  Finish(Outcome::unexpected, "the reply may belong to an earlier request that got none");
}

void JobRun::TakeAnswer() {
  Job& job = *job_;
  Device& device = *job.member->device;
  const Outcome outcome = job.attempt.answer.outcome;
  Answer answer = std::exchange(job.attempt.answer, {});
  upkeep_.OnHeard(device, now_.instant);
  if (auto* const write = job.As<Job::Write>(); write != nullptr) {
    write->may_have_acted = answer.may_have_acted;
    // That a step which only prepares has succeeded says nothing of the write.
    const bool counts = write->sent() || outcome != Outcome::ok;
    if (counts && !job.step.request.closes) write->told = {outcome, answer.reason};
  }
  const Duration wait = answer.wait;
  const Then then = answer.then;
  const std::string reason = answer.reason;
  for (const Reading& reading : answer.readings) {
    if (HasValue(reading.value) && reading.point != kNoPoint)
      device.heard.OnValue(reading.point, now_.instant);
  }
  effects_.OnReply(job, device, std::move(answer), now_.instant);
  if (wait > Duration::zero()) agenda_.schedule.Hold(device.place, now_.instant + wait);
  if (then == Then::ask_again) return Ask();
  if (then == Then::replan || then == Then::restart) {
    upkeep_.Replan(device, now_.instant);
    if (then == Then::replan) {
      agenda_.schedule.GoOn(device.place, now_.instant);
    } else if (device.in_use) {
      agenda_.schedule.RestartAsPlanned(device.place, now_.instant);
    }
    return Finish(outcome, reason);
  }
  const bool read = job.task.kind == Task::Kind::poll;
  const bool parks = outcome == Outcome::busy && read && job.parkings < device.retries &&
                     device.in_use && !agenda_.parked.HasLike(job);
  if (!parks) return Finish(outcome, reason);
  ++job.parkings;
  --job.requests;
  Park(now_.instant + std::max<Duration>(wait, device.times.quiet));
}

void JobRun::OnFailed(const ExchangeEnd& end) {
  Job& job = *job_;
  Member& member = *job.member;
  const bool heard_itself = job.attempt.answer.outcome == Outcome::unexpected;
  job.attempt.answer = {};
  job.had_failure = true;
  if (auto* routed = job.As<Job::Routed>()) return OnRoutedFailure(*routed, end);
  // Another request's reply has come, so one fewer stands before ours. That is not so if the sender
  // owes none, or has answered this request in an odd form.
  const Asked asked = job.asked();
  const bool nearer = end.outcome == Outcome::unexpected && !job.attempt.verdict.odd &&
                      (heard_itself || !asked.named() || owed_.whose.orders().OthersOwe(asked));
  const int more = nearer ? std::min(owed_.whose.orders().Owed(asked), kMostTriesMore) : 0;
  if (!chooser_.MayRepeat(job, more, now_.instant)) return GiveUp(end);
  Request& request = job.step.request;
  const auto instead = member.device->conversation->Instead(request, end.outcome, now_.instant);
  if (!instead && !request.expect.repeatable) return GiveUp(end);
  if (instead) request = *instead;
  ++job.step.retries;
  job.step.waiting = true;
  ledger_.devices.OnRetry(member);
}

/// A routed read whose reply was damaged waits for its turn again, where that can do no harm. After
/// silence the client decides: it may want something else by now. A request that the slave does not
/// know, or an odd reply, says nothing about the slave.
void JobRun::OnRoutedFailure(Job::Routed& routed, const ExchangeEnd& end) {
  Job& job = *job_;
  const Member& member = *job.member;
  upkeep_.HoldBack(member);
  const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
  const RoutedRequest* const first = routed.first();
  const bool tries_left = first != nullptr && first->tries < member.retries;
  if (damaged && routed.is_read && !job.probe_budget && tries_left) {
    ledger_.devices.OnRetry(member);
    for (RoutedRequest& request : routed.batch) ++request.tries;
    agenda_.routes.queue().Return(std::move(routed.batch));
    job_.reset();
    return;
  }
  if (!routed.every_slave_answers || routed.odd) job.judges_member = false;
  Finish(end.outcome, end.reason);
}

void JobRun::GiveUp(const ExchangeEnd& end) {
  FollowPlan(*job_);
  Device& device = *job_->member->device;
  const auto queries = device.conversation->Queries();
  const bool silent = job_->task.kind == Task::Kind::poll && end.outcome == Outcome::no_reply;
  job_->blames_query = silent && job_->task.query < queries.size() &&
                       !device.heard.TellsOfDevice(queries[job_->task.query].points, now_.instant);
  auto* const write = job_->As<Job::Write>();
  if (write != nullptr && !job_->step.request.closes) write->told = {end.outcome, end.reason};
  const Then then =
      device.conversation->OnFailure(job_->task, job_->step.request, end.outcome, now_.instant);
  upkeep_.OnHeard(device, now_.instant);
  if (then == Then::ask_again) return Ask();
  if (then == Then::replan) {
    upkeep_.Replan(device, now_.instant);
    agenda_.schedule.GoOn(device.place, now_.instant);
  }
  upkeep_.HoldBack(device);
  Finish(end.outcome, end.reason);
}

}  // namespace baudgate
