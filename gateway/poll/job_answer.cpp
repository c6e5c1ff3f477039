// The answer to a job's request: whose it is, what it means, and what of it goes to the store and
// to whoever listens. The table of all its states is in job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/poll/job_run.h"
#include "gateway/poll/samples.h"

namespace baudgate {
namespace {

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

Outcome JobRun::Judge(View frame, bool may_be_echo, Instant now) {
  Job& job = *job_;
  Answer& answer = job.answer;
  answer = {};
  if (may_be_echo) {
    answer.reason =
        "a good reply equals its request, and this bus echoes requests: perhaps nobody has "
        "answered; set 'echo: strip' at the line";
    return answer.outcome = Outcome::unexpected;
  }
  Device* const device = roster_.AsDevice(*job.member);
  auto* const routed = job.As<Job::Routed>();
  Outcome outcome = routed != nullptr ? JudgeRouted(frame)
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
      Answer said = device->conversation->Interpret(job.request.bytes, frame);
      answer.reason = std::move(said.reason);
      answer.remedy = std::move(said.remedy);
      if (answer.reason.empty()) {
        answer.reason = "not the form that was asked for; does the profile fit?";
      }
    }
    return answer.outcome = outcome;
  }
  const bool asks = routed == nullptr && !job.is_probe();
  if (job.verdict.elsewhere || (asks && !job.verdict.proven)) {
    answer.reason =
        "the reply may belong to an earlier request; it is asked again until that is certain";
    job.doubted = true;
    const bool refuses = outcome != Outcome::ok && routed == nullptr;
    if (refuses) {
      Answer said = device->conversation->Interpret(job.request.bytes, frame);
      job.said = std::move(said.reason);
      answer.remedy = std::move(said.remedy);
    }
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

/// Where nothing else is owed, a reply of the right slave and function is the reply, whatever its
/// form: Enron's registers of 32 bits, a device that limits what is written. Only a write that
/// comes back whole may be the bus.
Outcome JobRun::JudgeRouted(View frame) {
  Job& job = *job_;
  Job::Routed& routed = *job.As<Job::Routed>();
  const Bytes& request = job.request.bytes;
  const Outcome outcome = roster_.carrier()->carrier->unwrap(request, frame, routed.reply);
  routed.older = {};
  if (outcome != Outcome::unexpected) {
    const auto fits = [&](const Bytes& lost) {
      Bytes pdu;
      return ProvesLife(roster_.carrier()->carrier->unwrap(lost, frame, pdu));
    };
    routed.older = whose_reply_.lost().MayBe(*job.member, request, job.exchange_began, fits);
    return outcome;
  }
  routed.odd = true;
  const bool may_be_bus = !echo_free_ && std::ranges::equal(frame, request);
  const bool its_own = !routed.reply.empty() && whose_reply_.IsOwedAlone(job.asked());
  return its_own && !may_be_bus ? Outcome::ok : outcome;
}

void JobRun::OnEnd(ExchangeEnd end) {
  late_.OnEnd(job_->asked(), end.outcome, now_.instant);
  job_->end = std::move(end);
}

std::optional<ExchangeEnd> JobRun::TakeEnd() {
  return job_ ? std::exchange(job_->end, std::nullopt) : std::nullopt;
}

/// What the bytes do not show: what the device has said, and that its reply was not taken.
void JobRun::Explain(const Job& job, const ExchangeEnd& end, Finding& finding) {
  const bool refuses = ProvesLife(end.outcome) && end.outcome != Outcome::ok;
  if (refuses || (job.doubted && !job.said.empty())) {
    finding.symptom = Symptom::refusal;
    finding.cause = refuses ? end.reason : job.said;
    finding.remedy = job.answer.remedy;
  } else if (job.doubted) {
    finding.symptom = Symptom::doubted;
  } else if (finding.symptom == Symptom::odd) {
    if (end.reason.empty()) finding.symptom = Symptom::silence;  // which an earlier one has met
    finding.cause = end.reason;
    finding.remedy = job.answer.remedy;
  } else if (finding.symptom == Symptom::one_behind) {
    finding.cause = end.reason;
  }
}

void JobRun::Conclude(ExchangeEnd end, Finding finding) {
  Job& job = *job_;
  Member& member = *job.member;
  const Asked asked = job.asked();
  if (!job.answer.reason.empty()) end.reason = job.answer.reason;
  Explain(job, end, finding);
  const bool answered = ProvesLife(end.outcome);
  const bool lost = end.outcome == Outcome::line_down;
  if (answered && !job.request.expect.mirrors) echo_free_ = !echoed_;
  job.mute = job.request.expect.reply == Expectation::Reply::none;
  if (!job.mute) member.health.OnExchange(end.outcome);
  const bool by_count = whose_reply_.Lags(member);  // and no silence helps
  late_.Conclude(asked, end, by_count || whose_reply_.IsInStep(member), now_.instant);
  ledger_.OnPatience(member, late_.PatienceFor(member));
  if (answered && !late_.IsClear(member, now_.instant)) upkeep_.HoldBack(member);
  whose_reply_.OnEnd(asked, end.outcome, !lost && !job.mute, now_.instant);
  if (roster_.IsDevice(member) && !job.mute && !lost) {
    // What it took in vain counts from its first failure on; Advance charges what follows.
    const bool in_vain = !answered || member.health.refuses();
    if (in_vain && !schedule_.doubted(member.place)) {
      chooser_.turns().Charge(now_.instant - job.exchange_began);
    }
    schedule_.Doubt(member.place, in_vain);
    if (job.task.kind == Task::Kind::poll) {
      schedule_.OnUsed(member.place, now_.instant - job.exchange_began);
    }
  }
  if (job.verdict.shifted) upkeep_.DoubtLatest(now_.instant);
  if (answered) job.wire += now_.instant - job.exchange_began;
  ledger_.OnExchange(member, end, finding, job.mute, job.is_probe() && member.health.offline(),
                     job.As<Job::Routed>() != nullptr, UseOf(job));
  upkeep_.ShowLine(now_.instant);
  if (lost) return Finish(end.outcome, end.reason);
  if (answered && GoesOnBehindBroadcast()) return Ask(job.attempts);
  if (answered) return OnAnswered(end);
  OnFailed(end);
}

/// Nobody has answered what was sent, and nobody should have.
bool JobRun::GoesOnBehindBroadcast() {
  Job& job = *job_;
  if (!job.mute || job.As<Job::Routed>() != nullptr) return false;
  Conversation& conversation = *roster_.AsDevice(*job.member)->conversation;
  if (conversation.OnSent(job.task, job.request, now_.instant) != Then::ask_again) return false;
  ++job.broadcasts;
  return true;
}

/// A read is repeated while its reply may be that to one of long ago, and a probe until its reply
/// cannot be that to the probe of an earlier task: behind a server that lags, tasks look alike but
/// for one probe more. Somebody else may have answered a repetition: what it says waits until a
/// device that tells its name has told it.
void JobRun::OnAnswered(const ExchangeEnd& end) {
  Job& job = *job_;
  if (job.As<Job::Routed>() != nullptr) return OnRoutedAnswer(end);
  Device& device = *roster_.AsDevice(*job.member);
  job.answered = {now_.instant - end.since_reply, now_.wall - end.since_reply};
  job.round_trip = end.round_trip;
  job.late = LateAnswers::TookUntilReply(job.asked(), end) > job.member->times.reply;
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
  routes_.OnAnswered(now_.instant);
  const bool own =
      roster_.IsDevice(member)
          ? job.verdict.proven || routed.odd
          : whose_reply_.lost().OnReply(member, job.request.bytes, routed.older, ++routed.replies);
  if (own) return Finish(end.outcome, {});
  if (routed.is_read() && job.attempts < kMostTriesMore) {
    ++job.attempts;
    job.sending = true;
    return ledger_.OnRetry(member);
  }
  Finish(Outcome::unexpected, "the reply may belong to an earlier request that got none");
}

void JobRun::TakeAnswer() {
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
  if (answer.then == Then::replan || answer.then == Then::restart) {
    upkeep_.Plan(device);
    if (answer.then == Then::replan) {
      schedule_.GoOn(device.place, now_.instant);
    } else if (device.in_use) {
      schedule_.RestartAsPlanned(device.place, now_.instant);
    }
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

void JobRun::Report(const Device& device, EventBatch batch) {
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

/// What must not be read twice counts as it comes. A probe that reads a point is no better proof
/// of it than a poll.
JumpCheck::Result JobRun::CheckJumps(Device& device, std::vector<Sample>& samples) {
  const Job& job = *job_;
  if (job.task.kind == Task::Kind::write || !job.request.expect.repeatable) return {};
  const std::vector<std::uint32_t> points = PointsOf(samples);
  JumpCheck::Result result = device.jumps.Check(samples);
  if (!result.ask_again) return result;
  ledger_.OnRecheck(device);
  if (job.task.kind == Task::Kind::poll) {
    writes_.AddReadBack({device.place, job.task.query});
    return result;
  }
  const auto queries = device.conversation->Queries();
  for (const std::uint32_t point : points) writes_.AddReadBacks(device.place, queries, point);
  return result;
}

/// A reply that may be an earlier one's to the same request is as old as that, and a late one as
/// old as its request.
void JobRun::Store(Device& device, const Answer& answer) {
  const Duration older = job_->verdict.older + (job_->late ? job_->round_trip : Duration());
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
