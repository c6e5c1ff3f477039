// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job_answer.h"

#include <algorithm>
#include <string>
#include <utility>

namespace baudgate {
namespace {

/// The request was a broadcast: there was no answer, and none is due.
bool GoesOnBehindBroadcast(Job& job, Instant now) {
  if (!job.is_broadcast() || job.As<Job::Routed>() != nullptr) return false;
  Conversation& conversation = *job.member->device->conversation;
  if (conversation.OnSent(job.task, job.step.request, now) != Then::ask_again) return false;
  ++job.broadcasts;
  return true;
}

/// The latest word about the points of a write under way.
void NoteTold(Job& job, const Answer& answer) {
  auto* const write = job.As<Job::Write>();
  if (write == nullptr) return;
  write->may_have_acted = answer.may_have_acted;
  // That a step which only prepares has succeeded says nothing of the write.
  const bool counts = write->sent() || answer.outcome != Outcome::ok;
  if (counts && !job.step.request.closes) write->told = {answer.outcome, answer.reason};
}

}  // namespace

NextStep JobAnswer::Conclude(Job& job, ExchangeEnd end, const Finding& finding, Now now) {
  const bool cut_off = end.outcome == Outcome::line_down;
  if (!cut_off && !job.attempt.answer.reason.empty()) end.reason = job.attempt.answer.reason;
  job.judges_member = !job.is_broadcast();
  const bool answered = ProvesLife(end.outcome);
  upkeep_.OnExchange(job, end, finding, now.instant);
  if (answered) job.wire += now.instant - job.attempt.began;
  if (cut_off) return NextStep::Finish(end.outcome, end.reason);
  if (answered && GoesOnBehindBroadcast(job, now.instant)) return NextStep::Ask(job.step.retries);
  return answered ? OnAnswered(job, end, now) : OnFailed(job, end, now.instant);
}

/// The same request once more.
NextStep JobAnswer::Repeat(Job& job) {
  ++job.step.retries;
  job.step.waiting = true;
  return NextStep::Wait();
}

/// Another device may have answered a repetition, so news wait for a probe, if the device has a
/// name.
NextStep JobAnswer::OnAnswered(Job& job, const ExchangeEnd& end, Now now) {
  if (job.As<Job::Routed>() != nullptr) return OnRoutedAnswer(job, end);
  Job::Attempt& attempt = job.attempt;
  attempt.answered_at = {now.instant - end.since_reply, now.wall - end.since_reply};
  attempt.round_trip = end.round_trip;
  attempt.late = LateAnswers::Lateness(job.asked(), end) > Duration::zero();
  if (attempt.verdict.replaced) {
    effects_.OnReplaced(*job.member->device, now);
    if (job.postponed) job.postponed->attempt.answer = {};
  }
  if (MustRepeat(job, now.instant)) return Repeat(job);
  const bool in_doubt = job.has_news() && (job.had_failure || job.step.retries > 0);
  if (in_doubt && whose_.HasName(*job.member)) return NextStep::ProbeFirst();
  return Take(job, now.instant);
}

/// * A read is repeated while its reply may answer a much older one.
/// * A probe is repeated until its reply cannot answer the probe of an earlier task. Through a
///   server that lags, two tasks may differ by one probe only.
bool JobAnswer::MustRepeat(const Job& job, Instant now) const {
  const Job::Attempt& attempt = job.attempt;
  const Answer& answer = attempt.answer;
  const bool reads = job.task.kind == Task::Kind::poll && !answer.readings.empty();
  const bool much_older =
      whose_.Lags(*job.member) && attempt.verdict.older > job.member->times.ceiling;
  if (reads && job.step.request.expect.repeatable && much_older &&
      chooser_.MayRepeat(job, kMostTriesMore, now)) {
    return true;
  }
  const bool wants_peace = answer.outcome == Outcome::busy || answer.wait > Duration::zero();
  return job.postponed && !whose_.IsOfLatest(job.asked()) && !wants_peace &&
         chooser_.MayRepeat(job, kMostProbesMore, now);
}

/// A reply that seemed lost may come in place of the next one. So a read is repeated until its
/// reply must be its own: after n lost replies, that is reply n + 1 to the same request. Example
/// with one:
///
///   03 3BCA 0002    03 04 …    may be that to 03 3BC5 0002
///   03 3BCA 0002    03 04 …    is one to 03 3BCA 0002
NextStep JobAnswer::OnRoutedAnswer(Job& job, const ExchangeEnd& end) {
  Job::Routed& routed = *job.As<Job::Routed>();
  Member& member = *job.member;
  const bool own = member.device != nullptr
                       ? job.attempt.verdict.proven || routed.odd
                       : whose_.OnRoutedReply(job.asked(), routed.older, ++routed.replies);
  if (own) return NextStep::Finish(end.outcome, {});
  if (routed.is_read && job.step.retries < kMostTriesMore) {
    effects_.OnRetry(member);
    return Repeat(job);
  }
  return NextStep::Finish(Outcome::unexpected,
                          "the reply may belong to an earlier request that got none");
}

NextStep JobAnswer::Take(Job& job, Instant now) {
  Device& device = *job.member->device;
  Answer answer = std::exchange(job.attempt.answer, {});
  upkeep_.OnHeard(device, now);
  NoteTold(job, answer);
  const Outcome outcome = answer.outcome;
  const Duration wait = answer.wait;
  const Then then = answer.then;
  const std::string reason = answer.reason;
  for (const Reading& reading : answer.readings) {
    if (HasValue(reading.value) && reading.point != kNoPoint)
      device.heard.OnValue(reading.point, now);
  }
  effects_.OnReply(job, device, std::move(answer), now);
  if (then == Then::ask_again) return NextStep::Ask();
  if (then == Then::replan) upkeep_.GoOnWithPlan(device, now);
  if (then == Then::restart) upkeep_.RestartWithPlan(device, now);
  const bool same_plan = then != Then::replan && then != Then::restart;
  if (!same_plan || !MayPark(job, outcome)) return NextStep::Finish(outcome, reason);
  ++job.parkings;
  --job.requests;
  return NextStep::Park(now + std::max<Duration>(wait, device.times.quiet));
}

/// A device that was busy is read again soon.
bool JobAnswer::MayPark(const Job& job, Outcome outcome) const {
  const Member& member = *job.member;
  return outcome == Outcome::busy && job.task.kind == Task::Kind::poll &&
         job.parkings < member.retries && member.in_use && !parked_.HasLike(job);
}

NextStep JobAnswer::OnFailed(Job& job, const ExchangeEnd& end, Instant now) {
  Member& member = *job.member;
  const bool heard_itself = job.attempt.answer.outcome == Outcome::unexpected;
  job.attempt.answer = {};
  job.had_failure = true;
  if (auto* routed = job.As<Job::Routed>()) return OnRoutedFailure(job, *routed, end);
  // Another request's reply has come, so one fewer stands before ours. That is not so if the sender
  // owes none, or has answered this request in an odd form.
  const bool nearer = end.outcome == Outcome::unexpected && !job.attempt.verdict.odd;
  const int before = nearer ? whose_.RepliesBefore(job.asked(), heard_itself) : 0;
  if (!chooser_.MayRepeat(job, std::min(before, kMostTriesMore), now)) return GiveUp(job, end, now);
  Request& request = job.step.request;
  const auto instead = member.device->conversation->Instead(request, end.outcome, now);
  if (!instead && (!request.expect.repeatable || !request.context.empty())) {
    return GiveUp(job, end, now);
  }
  if (instead) request = *instead;
  effects_.OnRetry(member);
  return Repeat(job);
}

/// A routed read whose reply was damaged waits for its turn again, where that can do no harm. After
/// silence the client decides: it may want something else by now. A request that the slave does not
/// know, or an odd reply, says nothing about the slave.
NextStep JobAnswer::OnRoutedFailure(Job& job, Job::Routed& routed, const ExchangeEnd& end) {
  const Member& member = *job.member;
  upkeep_.HoldBack(member);
  const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
  const RoutedRequest* const first = routed.first();
  const bool tries_left = first != nullptr && first->tries < member.retries;
  if (damaged && routed.is_read && !job.probe_budget && tries_left) {
    effects_.OnRetry(member);
    for (RoutedRequest& request : routed.batch) ++request.tries;
    return NextStep::BackInQueue();
  }
  if (!routed.every_slave_answers || routed.odd) job.judges_member = false;
  return NextStep::Finish(end.outcome, end.reason);
}

NextStep JobAnswer::GiveUp(Job& job, const ExchangeEnd& end, Instant now) {
  FollowPlan(job);
  Device& device = *job.member->device;
  const auto queries = device.conversation->Queries();
  const bool silent = job.task.kind == Task::Kind::poll && end.outcome == Outcome::no_reply;
  job.blames_query = silent && job.task.query < queries.size() &&
                     !device.heard.TellsOfDevice(queries[job.task.query].points, now);
  auto* const write = job.As<Job::Write>();
  if (write != nullptr && !job.step.request.closes) write->told = {end.outcome, end.reason};
  const Then then = device.conversation->OnFailure(job.task, job.step.request, end.outcome, now);
  upkeep_.OnHeard(device, now);
  if (then == Then::ask_again) return NextStep::Ask();
  if (then == Then::replan) upkeep_.GoOnWithPlan(device, now);
  upkeep_.HoldBack(device);
  return NextStep::Finish(end.outcome, end.reason);
}

}  // namespace baudgate
