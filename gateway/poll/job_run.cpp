// A job from its first request to its end. One exchange is gateway/line/line.h's affair; here is
// what its end leads to.
//
// clang-format off
//   the job               what happens                        next
//   chosen                it asks, or its request is ready    waiting
//   chosen                the conversation will not ask       ended: unsupported
//   waiting, a poll       a late reply of its device is due   parked, where replies name their sender
//   waiting               line idle, a reply to an earlier    postponed behind a probe of its device
//                         request could pass for its own
//   waiting               line idle, nothing owed any more    under way (quiet, sending, receiving)
//   waiting, quiet        its deadline came, its client left, broken off: what it has begun is closed,
//                         or its device was disabled          else ended: no_reply
//   quiet, a routed read  a short write came                  back in its queue
//   under way             a good reply, a step remains        waiting, for the next request
//   under way             a good reply, nothing remains       ended: its outcome
//   under way             a broadcast out, a step remains     waiting, for the next request
//   under way             busy, of a poll                     parked, as often as there are retries
//   under way             silence, damage, another's reply    waiting, to be repeated: Chooser::MayRepeat
//   under way             the same, of a routed read          back in its queue after damage, else
//                                                             ended: its client judges
//   under way             the same, no retry left             a step that closes what is open, or ended
//   under way             the port is lost                    ended: line_down
//   postponed             its probe was answered in order     waiting
//   postponed             it was not                          ended: as the probe
//   a write, ended ok     points of its command remain        chosen, with the next point
//   a write, ended ok     none remains                        confirmed: answered after the read-back
// clang-format on
//
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/poll/poller.h"
#include "gateway/poll/samples.h"

namespace baudgate {
namespace {

/// False: its device has fewer queries since it began. Example: a poll of query 7 waits behind a
/// probe, and what the probe is answered leaves 5 queries.
bool IsPlanned(const Task& task, const Conversation& conversation) {
  if (task.kind == Task::Kind::events) return conversation.HasEvents();
  if (task.kind == Task::Kind::background) return conversation.BackgroundDue().has_value();
  return task.kind != Task::Kind::poll || task.query < conversation.Queries().size();
}

bool IsReading(const Job& job) {
  return job.task.kind == Task::Kind::poll && !job.answer.readings.empty();
}

/// A point that is read once is bad. Example: another meter answers, so that all points of this one
/// are; the right one may be back tomorrow.
bool SpoilsOnce(const Answer& answer, const config::Device& device) {
  return std::ranges::any_of(answer.readings, [&](const Reading& reading) {
    return reading.point < device.points.size() && !IsGood(reading.quality) &&
           device.points[reading.point].group == config::Group::once;
  });
}

}  // namespace

// ---------------------------------------------------------------- to the request

void Poller::Ask(int attempts) {
  if (++job_->steps > kMostSteps) {
    return Finish(Outcome::unexpected, "the conversation did not come to an end");
  }
  Conversation& conversation = *roster_.AsDevice(*job_->member)->conversation;
  if (!IsPlanned(job_->task, conversation)) {
    job_->mute = true;
    return Finish(Outcome::busy, "its query is not planned any more");
  }
  auto request = conversation.Ask(job_->task, now_.instant);
  if (!request) {
    job_->mute = true;
    ledger_.OnUnsupported(*job_->member, request.error());
    return Finish(Outcome::unsupported, request.error());
  }
  job_->request = std::move(*request);
  job_->attempts = attempts;
  job_->sending = true;
}

/// The points of the command before the next one are written; as many as one exchange carries come
/// next.
void Poller::NextWrite() {
  Job::Write& write = *job_->As<Job::Write>();
  const Device& device = *roster_.AsDevice(*job_->member);
  if (write.command.why_not) {
    const std::string why = write.command.why_not(now_.instant);
    if (!why.empty()) return Deny(why);
  }
  std::vector<PointValue> rest;
  for (std::size_t i = write.next; i < write.command.writes.size(); ++i) {
    rest.push_back({write.command.writes[i].point, write.command.writes[i].raw});
  }
  rest.resize(std::clamp<std::size_t>(device.conversation->WritesTogether(rest), 1, rest.size()));
  write.first = std::exchange(write.next, write.next + rest.size());
  write.sent = false;
  write.told.reset();
  write.may_have_acted = false;
  Task& task = job_->task;
  task.kind = Task::Kind::write;
  task.point = rest.front().point;
  task.value = rest.front().value;
  task.also.assign(rest.begin() + 1, rest.end());
  for (const PointValue& one : rest) {
    writes_.OnBegun(device.index, static_cast<std::uint32_t>(one.point));
    ReadBack(device, one.point);
  }
  Ask();
}

/// What of the command has not been begun is not.
void Poller::Deny(const std::string& why) {
  const std::unique_ptr<Job> job = std::move(job_);
  const Job::Write& write = *job->As<Job::Write>();
  ledger_.OnWrite(*job->member, WriteEnd::denied, false);
  write.command.done({WriteEnd::denied, why, false, write.next});
}

void Poller::PutProbeFirst() {
  auto probe = std::make_unique<Job>(*job_->member, Job::Probe{}, Task{.kind = Task::Kind::probe},
                                     now_.instant);
  probe->behind = std::move(job_);
  job_ = std::move(probe);
  Ask();
}

void Poller::Start() {
  const Member& member = *job_->member;
  if (idle_since_ + member.times.reply <= now_.instant) whose_reply_.OnRested();
  const Device* const device = roster_.AsDevice(member);
  const bool trusted = device != nullptr && device->config->trust_order;
  if (trusted && job_->attempts == 0) whose_reply_.OnTrusted(member);
  job_->sending = false;
  job_->verdict = {};
  job_->exchange_began = now_.instant;
  Exchange exchange{job_->request, member.protocol->reply_rule, member.times, {}, {}};
  exchange.lags = whose_reply_.Lags(member);
  const Duration more = job_->request.reply - exchange.times.reply;
  if (more > Duration::zero()) {
    exchange.times.reply += more;
    exchange.times.ceiling += more;
  }
  exchange.times.drain += late_.ExtraDrain(member);
  exchange.aftermath = late_.Aftermath(job_->asked(), now_.instant);
  // Its own comes with the next request; a longer silence shows nothing.
  if (exchange.lags) exchange.aftermath = std::min(exchange.aftermath, member.times.drain);
  Hear(line_.Start(std::move(exchange), now_.instant));
}

void Poller::Send() {
  Request& request = job_->request;
  if (request.stamped) {
    const auto characters = static_cast<std::int64_t>(request.bytes.size());
    const Duration character = job_->member->times.character;
    const Duration takes = characters * character;
    roster_.AsDevice(*job_->member)
        ->conversation->Stamp(request, {now_.instant + takes, now_.wall + takes}, character);
  }
  auto* const write = job_->As<Job::Write>();
  if (write != nullptr && !request.prepares && !request.closes) write->sent = true;
  echo_.OnSent(request.bytes);
  chooser_.turns().OnSent(IsUrgent(job_->goal()));
  whose_reply_.OnSent(job_->asked(), now_.instant);
  ledger_.OnSent(*job_->member, request);
  listener_.Send(request.bytes, job_->member->serial);
}

/// A read that the line still waits with lets a short write pass, and what has become too late
/// meanwhile is not sent any more.
void Poller::CancelQuiet() {
  if (line_.state() != Line::State::quiet || !job_ || job_->end) return;
  if (const char* why = WhyNotSend(*job_, now_.instant)) {
    line_.Cancel();
    job_->exchange_began = {};
    return BreakOff(why);
  }
  auto* routed = job_->As<Job::Routed>();
  if (routed == nullptr || !routed->is_read()) return;
  RouteQueue& queue = routes_.queue();
  const auto urgent = [this](const RoutedRequest& request) {
    return RouteQueue::IsShortWrite(request) && chooser_.MayAsk(request, now_.instant);
  };
  if (!chooser_.turns().UrgentAllowed(queue.HasShortWrite()) || !queue.HasAny(urgent)) return;
  line_.Cancel();
  queue.Return(std::move(routed->batch));
  job_.reset();
}

/// What waits for the line is not sent. What it has begun is ended in order.
void Poller::BreakOff(const std::string& why) {
  Job& job = *job_;
  job.mute = true;
  const bool asks = job.As<Job::Routed>() == nullptr;
  const bool closes = asks && job.begun() &&
                      roster_.AsDevice(*job.member)
                              ->conversation->OnFailure(job.task, job.request, Outcome::busy,
                                                        now_.instant) == Then::ask_again;
  if (closes) return Ask();
  Finish(Outcome::no_reply, why);
}

// ---------------------------------------------------------------- the reply, and what it means

/// The conversation hears of a reply when it is certain whose it is.
Outcome Poller::Judge(View frame, Instant now) {
  Job& job = *job_;
  Answer& answer = job.answer;
  answer = {};
  if (echo_.MayBeEcho(job.request, frame)) {
    answer.reason =
        "a good reply equals its request, and this bus echoes requests: nobody need have answered; "
        "set 'echo: strip' at the line";
    return answer.outcome = Outcome::unexpected;
  }
  Device* const device = roster_.AsDevice(*job.member);
  auto* const routed = job.As<Job::Routed>();
  Outcome outcome = routed != nullptr ? roster_.carrier()->carrier->unwrap(job.request.bytes, frame,
                                                                           routed->reply)
                                      : device->conversation->Check(job.request.bytes, frame);
  if (device == nullptr) return answer.outcome = outcome;
  // A form that was not asked for, as where a profile is wrong, and yet its own.
  if (routed == nullptr && outcome == Outcome::unexpected && whose_reply_.MayBeOdd(job.asked())) {
    outcome = device->conversation->Interpret(job.request.bytes, frame).outcome;
  }
  if (ProvesLife(outcome) || outcome == Outcome::unexpected) {
    job.verdict = whose_reply_.OnReply(job.asked(), frame, outcome);
  }
  if (!ProvesLife(outcome)) {
    if (routed == nullptr) {
      answer.reason = device->conversation->Interpret(job.request.bytes, frame).reason;
      if (answer.reason.empty()) {
        answer.reason = "not the form that was asked for; does the profile fit?";
      }
    }
    return answer.outcome = outcome;
  }
  const bool asks = routed == nullptr && !job.is_probe();
  if (job.verdict.elsewhere || (asks && !job.verdict.proven)) {
    answer.reason =
        "the reply belongs to another request, or may: the device, or a serial server before it, "
        "answers late";
    return answer.outcome = Outcome::unexpected;
  }
  if (routed != nullptr) return answer.outcome = outcome;
  const bool planned = IsPlanned(job.task, *device->conversation);
  answer = planned ? device->conversation->OnFrame(job.task, job.request, frame, now)
                   : device->conversation->Interpret(job.request.bytes, frame);
  // What a probe reads may be nobody's, and what is not planned any more has not been checked.
  if (!planned || !job.verdict.proven) {
    answer.readings.clear();
    answer.batch.reset();
  }
  return answer.outcome;
}

void Poller::Conclude() {
  Job& job = *job_;
  Member& member = *job.member;
  const Asked asked = job.asked();
  if (echo_.OnExchangeEnd(job.request, *job.end)) ledger_.OnCollision();
  ledger_.OnRing(member, echo_.is_cut());
  ExchangeEnd end = std::move(*std::exchange(job.end, std::nullopt));
  if (!job.answer.reason.empty()) end.reason = job.answer.reason;
  const bool answered = ProvesLife(end.outcome);
  const bool lost = end.outcome == Outcome::line_down;
  job.mute = job.request.expect.reply == Expectation::Reply::none;
  if (!job.mute) member.health.OnExchange(end.outcome);
  const bool by_count = whose_reply_.Lags(member);  // and no silence helps
  late_.Conclude(asked, end, by_count || whose_reply_.IsInStep(member), now_.instant);
  if (answered && !late_.IsClear(member, now_.instant)) upkeep_.HoldBack(member);
  whose_reply_.OnEnd(asked, end.outcome, !lost && !job.mute, now_.instant);
  if (roster_.IsDevice(member) && !job.mute && !lost) {
    // What it took in vain counts from its first failure on; Advance charges what follows.
    if (!answered && !schedule_.doubted(member.place)) {
      chooser_.turns().Charge(now_.instant - job.exchange_began);
    }
    schedule_.Doubt(member.place, !answered);
  }
  if (job.verdict.shifted) upkeep_.DoubtLatest(now_.instant);
  if (answered) job.wire += now_.instant - job.exchange_began;
  ledger_.OnExchange(member, end, job.mute, job.is_probe() && member.health.offline(),
                     job.As<Job::Routed>() != nullptr);
  upkeep_.ShowLine(now_.instant);
  if (lost) return Finish(end.outcome, end.reason);
  if (answered && GoesOnBehindBroadcast()) return Ask(job.attempts);
  if (answered) return OnAnswered(end);
  listener_.OnNoReply();
  OnFailed(end);
}

/// Nobody has answered what was sent, and nobody should have.
bool Poller::GoesOnBehindBroadcast() {
  Job& job = *job_;
  if (!job.mute || job.As<Job::Routed>() != nullptr) return false;
  Conversation& conversation = *roster_.AsDevice(*job.member)->conversation;
  if (conversation.OnSent(job.task, job.request, now_.instant) != Then::ask_again) return false;
  ++job.broadcasts;
  return true;
}

/// A read is repeated while its reply may be that to one of long ago, and a probe until its reply
/// can not be that to the probe of an earlier task: behind a server that lags, tasks look alike but
/// for one probe more. Somebody else may have answered a repetition: what it says waits until a
/// device that tells its name has told it.
void Poller::OnAnswered(const ExchangeEnd& end) {
  Job& job = *job_;
  if (job.As<Job::Routed>() != nullptr) {
    routes_.OnAnswered(now_.instant);
    return Finish(end.outcome, {});
  }
  Device& device = *roster_.AsDevice(*job.member);
  job.answered = {now_.instant - end.since_reply, now_.wall - end.since_reply};
  job.round_trip = end.round_trip;
  if (job.verdict.replaced) {
    upkeep_.OnReplaced(device, now_);
    told_.OnReplaced(device);
    if (job.behind) job.behind->answer = {};
  }
  const bool reads = IsReading(job) && job.request.expect.repeatable;
  const bool late = whose_reply_.Lags(*job.member) && job.verdict.older > job.member->times.ceiling;
  const bool old = reads && late && chooser_.MayRepeat(job, kMostTriesMore, now_.instant);
  const bool peace = job.answer.outcome == Outcome::busy || job.answer.wait > Duration::zero();
  const bool alike = job.behind && !peace && !whose_reply_.IsOfLatest(job.asked()) &&
                     chooser_.MayRepeat(job, kMostProbesMore, now_.instant);
  if (old || alike) {
    ++job.attempts;
    job.sending = true;
  } else if (job.has_news() && (job.missed || job.attempts > 0) &&
             whose_reply_.HasName(*job.member)) {
    PutProbeFirst();
  } else {
    TakeAnswer();
  }
}

void Poller::TakeAnswer() {
  Job& job = *job_;
  Device& device = *roster_.AsDevice(*job.member);
  const Outcome outcome = job.answer.outcome;
  Answer answer = std::exchange(job.answer, {});
  upkeep_.OnHeard(device, now_.instant);
  if (auto* const write = job.As<Job::Write>(); write != nullptr) {
    write->may_have_acted = answer.may_have_acted;
    if (write->sent && !job.request.closes) write->told = outcome;
  }
  Store(device, answer);
  if (answer.batch) Report(device, std::move(*answer.batch));
  if (answer.wait > Duration::zero()) schedule_.Hold(device.place, now_.instant + answer.wait);
  if (answer.then == Then::ask_again) return Ask();
  if (answer.then == Then::replan) {
    upkeep_.Plan(device);
    if (device.in_use) schedule_.RestartAsPlanned(device.place, now_.instant);
    return Finish(outcome, answer.reason);
  }
  const bool read = job.task.kind == Task::Kind::poll;
  const bool parks = outcome == Outcome::busy && read && job.parkings < device.retries &&
                     device.in_use && !chooser_.IsParked(device);
  if (!parks) return Finish(outcome, answer.reason);
  ++job.parkings;
  --job.steps;
  const Instant until = now_.instant + std::max<Duration>(answer.wait, device.times.quiet);
  schedule_.Hold(device.place, until);
  chooser_.Park(std::move(job_), until);
}

void Poller::Report(const Device& device, EventBatch batch) {
  const ToldEvents::Exchange exchange{job_->exchange_began, job_->answered,
                                      job_->task.kind == Task::Kind::background};
  const bool drained = batch.drained;
  std::optional<ReportedEvents> events = told_.Take(device, std::move(batch), exchange);
  if (!events) {
    if (drained) listener_.OnDrained(device.index, exchange.asked);
    return;
  }
  schedule_.HoldEvents(device.place);
  chooser_.background().Hold(device.place);
  listener_.OnEvents(std::move(*events));
}

/// What must not be read twice counts as it comes.
JumpCheck::Result Poller::CheckJumps(Device& device, std::vector<Sample>& samples) {
  const Job& job = *job_;
  if (job.task.kind != Task::Kind::poll || !job.request.expect.repeatable) return {};
  JumpCheck::Result result = device.jumps.Check(samples);
  if (result.ask_again) {
    writes_.AddReadBack({device.place, job.task.query});
    ledger_.OnRecheck(device);
  }
  return result;
}

/// A reply that may be an earlier one's to the same request is as old as that.
void Poller::Store(Device& device, const Answer& answer) {
  const Duration older = job_->verdict.older;
  std::vector<Sample> samples = SamplesOf(*device.config, answer.readings);
  if (samples.empty()) return;
  const JumpCheck::Result jumps = CheckJumps(device, samples);
  const Now at{job_->answered.instant - older, job_->answered.wall - older};
  store_.Update(device.index, samples, at, job_->round_trip);
  store_.Doubt(device.index, jumps.doubtful, now_.instant);
  if (SpoilsOnce(answer, *device.config)) {
    upkeep_.Repeat(device, config::Group::once, now_.instant);
  }
  if (jumps.spoils) upkeep_.Repeat(device, *jumps.spoils, now_.instant);
  listener_.OnRead(device.index, PointsOf(samples), at);
  if (job_->task.kind == Task::Kind::poll) whose_reply_.OnStored({device.place, job_->task.query});
}

}  // namespace baudgate
