// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job_phases.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "gateway/bus/jobs/job_end.h"

namespace baudgate::bus {

NextStep JobAsking::Ask(Job& job, int repeats, Instant now) {
  if (++job.requests > protocols::kMostSteps) {
    return NextStep::Finish(
        Outcome::unexpected,
        "the task needed more than " + std::to_string(protocols::kMostSteps) + " requests");
  }
  protocols::Conversation& conversation = *job.member->device->conversation;
  FollowPlan(job);
  if (!IsPlanned(job.task, conversation)) {
    job.judges_member = false;
    job.unplanned = true;
    return NextStep::Finish(
        Outcome::busy, "the query no longer exists: the points of the device were planned again");
  }
  auto request = conversation.Ask(job.task, now);
  if (job.is_probe()) {
    probes_.OnAsked(*job.member, bool(request), now);
    if (!request && job.postponed) return NextStep::GoUnproved(request.error());
  }
  if (!request) {
    job.judges_member = false;
    job.unasked = true;
    if (!job.is_probe()) accounts_.OnUnsupported(*job.member, request.error());
    return NextStep::Finish(Outcome::unsupported, request.error());
  }
  if (job.probe_budget == Probes::Kind::rested_look) {
    request->quiet = std::max(request->quiet, Probes::kRest);
  }
  job.step = {.request = std::move(*request), .waiting = true, .repeats = repeats};
  return NextStep::Wait();
}

namespace {

/// The next step of a read waits for a late reply of its device. If replies carry an address, the
/// line does not wait.
bool WaitsBesideLine(const Job& job, const ParkedJobs& parked) {
  const protocols::Task::Kind kind = job.task.kind;
  const bool reads = kind == protocols::Task::Kind::poll || kind == protocols::Task::Kind::events ||
                     kind == protocols::Task::Kind::background;
  return reads && job.asked().named() && !parked.HasLike(job);
}

/// The waiting request is not sent. What the job has begun is closed properly.
NextStep BreakOff(Job& job, const Withheld& withheld, Instant now) {
  job.judges_member = false;
  if (auto* const write = job.As<Job::Write>()) write->withheld = withheld;
  const bool asks = job.As<Job::Routed>() == nullptr;
  if (asks && job.begun()) {
    protocols::Conversation& conversation = *job.member->device->conversation;
    const protocols::Then then =
        conversation.OnFailure(job.task, job.step.request, Outcome::busy, now);
    if (then == protocols::Then::ask_again) return NextStep::Ask();
  }
  return NextStep::Finish(Outcome::no_reply, withheld.why);
}

}  // namespace

NextStep JobDeparture::Decide(Job& job, Instant now) {
  if (const auto withheld = WhyNotSend(job, now)) return BreakOff(job, *withheld, now);
  whose_.Recognise(*job.member, job.step.request.expect.address);
  if (whose_.NeedsProbeFirst(job.asked(), now)) {
    const Device& device = *job.member->device;
    const bool writes = job.As<Job::Write>() != nullptr;
    if (!writes || !whose_.IsProbedByWrites(device)) return NextStep::ProbeFirst();
    job.unprovable = true;
    whose_.OnNoProof(device, now);
  }
  // A retry does not wait: a late reply to its first try is as good as its own.
  const Instant clear = late_.ClearAt(job.asked());
  if (job.step.repeats > 0 || clear <= now) return NextStep::Send();
  return WaitsBesideLine(job, agenda_.parked) ? NextStep::Park(clear) : NextStep::Hold();
}

std::optional<Instant> JobDeparture::NextAt(const Job& job) const {
  const bool repeats = job.step.repeats > 0;
  return Soonest({repeats ? std::nullopt : std::optional(late_.ClearAt(job.asked())),
                  LatestStart(job.goal())});
}

std::optional<NextStep> JobDeparture::Withdraw(Job& job, Instant now) {
  if (const auto withheld = WhyNotSend(job, now)) return BreakOff(job, *withheld, now);
  const auto* const routed = job.As<Job::Routed>();
  const bool lets_pass = routed != nullptr && routed->is_read && chooser_.ShortWriteGoesFirst(now);
  return lets_pass ? std::optional(NextStep::BackInQueue()) : std::nullopt;
}

void JobDeparture::Park(std::unique_ptr<Job> job, Instant until) {
  agenda_.schedule.Hold(job->member->place, until);
  agenda_.parked.Park(std::move(job), until);
}

Exchange JobSending::Start(Job& job, Instant idle_since, Instant now) {
  const Device* const device = job.member->device;
  const bool trusted = device != nullptr && device->config->trust_order;
  job.step.waiting = false;
  job.attempt = {.began = now, .sent_at = now, .job_was_sent = job.was_sent};
  return owed_.ExchangeOf(job.asked(), trusted, idle_since, now);
}

const protocols::Request& JobSending::Send(Job& job, Now now) {
  protocols::Request& request = job.step.request;
  if (request.stamped) {
    const Duration character = job.member->times.character;
    const Duration takes = TransmissionTime(request, character);
    job.member->device->conversation->Stamp(request, {now.instant + takes, now.wall + takes},
                                            character);
  }
  if (auto* const write = job.As<Job::Write>()) {
    write->may_have_written_before = write->sent();
    if (!request.prepares && !request.closes) NoteWriting(*write, *job.member->device);
  }
  turns_.OnSent(IsUrgent(job.goal()));
  owed_.whose.OnSent(job.asked(), now.instant);
  if (job.probe_budget && !job.was_sent) account_.OnProbe();
  account_.OnSent(*job.member, request);
  job.attempt.sent_at = now.instant;
  job.was_sent = true;
  return request;
}

/// A request that may write the points under way goes out.
void JobSending::NoteWriting(Job::Write& write, const Device& device) {
  write.command.MoveTo(WriteState::sent);
  write.told.reset();
  std::vector<std::size_t> points;
  for (std::size_t i = write.first; i < write.next; ++i) {
    points.push_back(write.command.writes()[i].point);
    writes_.OnBegun(device.index, write.command.writes()[i].point);
  }
  writes_.AddReadBacks(device.place, device.conversation->Queries(), points);
}

void JobSending::NeverLeft(Job& job) {
  job.was_sent = job.attempt.job_was_sent;
  auto* const write = job.As<Job::Write>();
  if (write != nullptr && write->sent() && !write->may_have_written_before) {
    write->command.MoveTo(WriteState::queued);
  }
}

namespace {

/// "'<1D:READY:4B' has "; empty: it is no text, or may repeat a password.
std::string Quoted(const protocols::Request& request, View frame) {
  const std::string_view text = Trim(AsText(frame));
  const bool printable = std::ranges::all_of(text, [](char c) { return c >= 0x20 && c < 0x7F; });
  if (text.empty() || !printable || !request.expect.secrets.empty()) return {};
  return "'" + std::string(text) + "' has ";
}

}  // namespace

Outcome ReplyJudge::Judge(Job& job, View frame, bool may_be_echo, Instant now) {
  const protocols::Request& request = job.step.request;
  Job::Attempt& attempt = job.attempt;
  protocols::Answer& answer = attempt.answer;
  if (may_be_echo) {
    answer.reason =
        "a good reply equals its request, and this bus echoes requests: perhaps nobody has "
        "answered; set 'echo: strip' in the configuration";
    return answer.outcome = Outcome::unexpected;
  }
  Device* const device = job.member->device;
  const bool routed = job.As<Job::Routed>() != nullptr;
  FollowPlan(job);
  Outcome outcome =
      routed ? JudgeRouted(job, frame) : device->conversation->Check(request.bytes, frame);
  if (device == nullptr) return answer.outcome = outcome;
  // A form that was not asked for, as where a profile is wrong, and yet its own.
  if (!routed && outcome == Outcome::unexpected && whose_reply_.MayBeOdd(job.asked())) {
    outcome = device->conversation->Interpret(request.bytes, frame).outcome;
  }
  if (ProvesLife(outcome) || outcome == Outcome::unexpected) {
    attempt.verdict = whose_reply_.OnReply(job.asked(), frame, outcome);
  }
  if (!ProvesLife(outcome)) return routed ? answer.outcome = outcome : Refuse(job, frame, outcome);
  const bool asks = !routed && !job.is_probe();
  if (attempt.verdict.elsewhere || (asks && !attempt.verdict.proven)) {
    return LeaveUnproven(job, frame, outcome);
  }
  return routed ? answer.outcome = outcome : Read(job, frame, now);
}

/// It may belong to an earlier request.
Outcome ReplyJudge::LeaveUnproven(Job& job, View frame, Outcome outcome) {
  protocols::Answer& answer = job.attempt.answer;
  auto& unproven = job.attempt.unproven;
  answer.reason =
      "the reply may belong to an earlier request; it is asked again until that is certain";
  unproven = Job::Unproven{};
  if (outcome != Outcome::ok && job.As<Job::Routed>() == nullptr) {
    protocols::Answer said =
        job.member->device->conversation->Interpret(job.step.request.bytes, frame);
    unproven = {.refusal = std::move(said.reason), .refused_as = outcome};
    answer.remedy = std::move(said.remedy);
  }
  return answer.outcome = Outcome::unexpected;
}

/// Has the conversation read the reply to the request of the job.
Outcome ReplyJudge::Read(Job& job, View frame, Instant now) {
  protocols::Conversation& conversation = *job.member->device->conversation;
  protocols::Answer& answer = job.attempt.answer;
  const bool planned = IsPlanned(job.task, conversation);
  answer = planned ? conversation.OnFrame(job.task, job.step.request, frame, now)
                   : conversation.Interpret(job.step.request.bytes, frame);
  job.unplanned = !planned;
  // Readings are dropped if the reply may belong to another request, or if the plan no longer has
  // the query, so that nothing could check them.
  if (!planned || !job.attempt.verdict.proven) {
    answer.readings.clear();
    answer.batch.reset();
  }
  return answer.outcome;
}

/// Not a good reply, in the words of its conversation.
Outcome ReplyJudge::Refuse(Job& job, View frame, Outcome outcome) {
  const protocols::Request& request = job.step.request;
  protocols::Answer& answer = job.attempt.answer;
  protocols::Answer said = job.member->device->conversation->Interpret(request.bytes, frame);
  answer.reason = std::move(said.reason);
  answer.remedy = std::move(said.remedy);
  if (answer.reason.empty()) {
    answer.reason = Quoted(request, frame) + "not the form that was asked for";
    answer.reason += "; does the profile fit?";
  }
  return answer.outcome = outcome;
}

/// Where nothing else is owed, a reply of the right slave and function is the reply, whatever its
/// form: Enron's registers of 32 bits, a device that limits what is written. Only a write that
/// comes back whole may be the bus.
Outcome ReplyJudge::JudgeRouted(Job& job, View frame) {
  Job::Routed& routed = *job.As<Job::Routed>();
  const protocols::PduCarrier& carrier = *job.member->protocol->carrier;
  const Bytes& request = job.step.request.bytes;
  const Outcome outcome = carrier.unwrap(request, frame, routed.reply);
  routed.older = {};
  if (outcome != Outcome::unexpected) {
    const auto fits = [&](const Bytes& lost) {
      Bytes pdu;
      return ProvesLife(carrier.unwrap(lost, frame, pdu));
    };
    routed.older = whose_reply_.MayBeLost(job.asked(), fits);
    return outcome;
  }
  routed.odd = true;
  const bool may_be_bus = !echo_free_ && std::ranges::equal(frame, request);
  const bool its_own = !routed.reply.empty() && whose_reply_.IsOwedAlone(job.asked());
  return its_own && !may_be_bus ? Outcome::ok : outcome;
}

void ReplyJudge::CompleteFinding(const Job& job, const ExchangeEnd& end, bool echoed,
                                 Finding& finding) {
  const bool answered = ProvesLife(end.outcome);
  if (answered && !job.step.request.expect.mirrors) echo_free_ = !echoed;
  const protocols::Answer& answer = job.attempt.answer;
  const auto& unproven = job.attempt.unproven;
  const std::string& reason = answer.reason.empty() ? end.reason : answer.reason;
  const bool refuses = answered && end.outcome != Outcome::ok;
  finding.outcome = end.outcome;
  finding.ended = end.ended;
  // The form of the reply to an earlier request; but the order of replies is proven.
  const bool proven = job.attempt.verdict.odd && finding.symptom == Symptom::one_behind;
  if (proven) finding.symptom = Symptom::odd;
  if (refuses || (unproven && !unproven->refusal.empty())) {
    finding.symptom = Symptom::refusal;
    if (!refuses) finding.outcome = unproven->refused_as;
    finding.cause = refuses ? reason : unproven->refusal;
    finding.remedy = answer.remedy;
  } else if (unproven) {
    finding.symptom = Symptom::doubted;
  } else if (finding.symptom == Symptom::clean && !reason.empty() && !answer.remedy.empty()) {
    finding.symptom = Symptom::no_number;
    finding.cause = answer.reason;
    finding.remedy = answer.remedy;
  } else if (finding.symptom == Symptom::clean && answer.no_number) {
    finding.symptom = Symptom::no_number;
    finding.cause = Printable(ToBytes(*answer.no_number));
  } else if (finding.symptom == Symptom::odd) {
    // Without a reason: the reply was good, and an earlier exchange has met it.
    if (reason.empty()) finding.symptom = Symptom::silence;
    finding.cause = reason;
    finding.remedy = answer.remedy;
  } else if (finding.symptom == Symptom::one_behind && finding.cause.empty()) {
    finding.cause = reason;
  }
}

namespace {

/// The request was a broadcast: there was no answer, and none is due.
bool GoesOnBehindBroadcast(Job& job, Instant now) {
  if (!job.is_broadcast() || job.As<Job::Routed>() != nullptr) return false;
  protocols::Conversation& conversation = *job.member->device->conversation;
  if (conversation.OnSent(job.task, job.step.request, now) != protocols::Then::ask_again)
    return false;
  ++job.broadcasts;
  return true;
}

/// The latest word about the points of a write under way.
void NoteTold(Job& job, const protocols::Answer& answer) {
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
  tracker_.OnExchange(job, end, finding, now.instant);
  if (answered) job.wire += now.instant - job.attempt.began;
  if (cut_off) return NextStep::Finish(end.outcome, end.reason);
  if (answered && GoesOnBehindBroadcast(job, now.instant)) return NextStep::Ask(job.step.repeats);
  return answered ? OnAnswered(job, end, now) : OnFailed(job, end, now.instant);
}

/// The same request once more.
NextStep JobAnswer::Repeat(Job& job) {
  ++job.step.repeats;
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
  attempt.after_reply_time = LateReplies::Lateness(job.asked(), end) > Duration::zero();
  if (attempt.verdict.replaced) {
    effects_.OnReplaced(*job.member->device, now);
    if (job.postponed) job.postponed->attempt.answer = {};
  }
  if (MustRepeat(job, now.instant)) return Repeat(job);
  const bool in_doubt = job.has_news() && (job.had_failure || job.step.repeats > 0);
  if (in_doubt && whose_.HasName(*job.member)) return NextStep::ProbeFirst();
  return Take(job, now.instant);
}

/// * A read is repeated while its reply may answer a much older one.
/// * A probe is repeated until its reply cannot answer the probe of an earlier task. Through a
///   server that lags, two tasks may differ by one probe only.
bool JobAnswer::MustRepeat(const Job& job, Instant now) const {
  const Job::Attempt& attempt = job.attempt;
  const protocols::Answer& answer = attempt.answer;
  const bool reads = job.task.kind == protocols::Task::Kind::poll && !answer.readings.empty();
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
  if (routed.is_read && job.step.repeats < kMostTriesMore) {
    effects_.OnRetry(member);
    return Repeat(job);
  }
  return NextStep::Finish(Outcome::unexpected,
                          "the reply may belong to an earlier request that got none");
}

NextStep JobAnswer::Take(Job& job, Instant now) {
  Device& device = *job.member->device;
  protocols::Answer answer = std::exchange(job.attempt.answer, {});
  tracker_.OnHeard(device, now);
  NoteTold(job, answer);
  const Outcome outcome = answer.outcome;
  const Duration wait = answer.wait;
  const protocols::Then then = answer.then;
  const std::string reason = answer.reason;
  for (const protocols::Reading& reading : answer.readings) {
    if (HasValue(reading.value) && reading.point != protocols::kNoPoint)
      device.heard.OnValue(reading.point, now);
  }
  effects_.ApplyReply(job, device, std::move(answer), now);
  if (then == protocols::Then::ask_again) return NextStep::Ask();
  if (then == protocols::Then::replan) tracker_.GoOnWithPlan(device, now);
  if (then == protocols::Then::restart) tracker_.RestartWithPlan(device, now);
  const bool same_plan = then != protocols::Then::replan && then != protocols::Then::restart;
  if (!same_plan || !ParksBusy(job, outcome)) return NextStep::Finish(outcome, reason);
  ++job.parkings;
  --job.requests;
  return NextStep::Park(now + std::max<Duration>(wait, device.times.quiet));
}

/// A device that was busy is read again soon.
bool JobAnswer::ParksBusy(const Job& job, Outcome outcome) const {
  const Member& member = *job.member;
  return outcome == Outcome::busy && job.task.kind == protocols::Task::Kind::poll &&
         job.parkings < member.max_retries && member.in_use && !parked_.HasLike(job);
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
  protocols::Request& request = job.step.request;
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
  tracker_.HoldBack(member);
  const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
  const RoutedRequest* const first = routed.first();
  const bool tries_left = first != nullptr && first->tries < member.max_retries;
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
  const bool silent =
      job.task.kind == protocols::Task::Kind::poll && end.outcome == Outcome::no_reply;
  job.blames_query = silent && job.task.query < queries.size() &&
                     !device.heard.TellsOfDevice(queries[job.task.query].points, now);
  auto* const write = job.As<Job::Write>();
  if (write != nullptr && !job.step.request.closes) write->told = {end.outcome, end.reason};
  const protocols::Then then =
      device.conversation->OnFailure(job.task, job.step.request, end.outcome, now);
  tracker_.OnHeard(device, now);
  if (then == protocols::Then::ask_again) return NextStep::Ask();
  if (then == protocols::Then::replan) tracker_.GoOnWithPlan(device, now);
  tracker_.HoldBack(device);
  return NextStep::Finish(end.outcome, end.reason);
}

namespace {

/// The job whose probe is over has its request again.
NextStep GoOn(Job& job) {
  if (job.As<Job::Routed>() != nullptr) return NextStep::Wait();  // its request is as it was
  job.requests = job.broadcasts = 0;
  return NextStep::Ask();
}

NextStep EndUnproved(Job& job, Outcome outcome, const std::string& reason, Instant now) {
  job.judges_member = false;
  if (job.attempt.answer.batch) {
    job.member->device->conversation->OnFailure(job.task, job.step.request, Outcome::unexpected,
                                                now);
  }
  return NextStep::Finish(outcome, reason);
}

}  // namespace

JobFinish::After JobFinish::Finish(std::unique_ptr<Job> done, const JobEnd& end, Instant now) {
  if (done->postponed) return Resume(*done, end, now);
  FollowPlan(*done);  // its own answer may have changed it
  auto rest = effects_.ApplyEnd(*done, EffectsOf(*done, end, now), end, now);
  if (!rest) return {};
  auto job = std::make_unique<Job>(*done->member, std::move(*rest), protocols::Task{}, now);
  BeginNextPoints(*job);
  return {std::move(job), NextStep::Ask()};
}

/// The probe that went before a task is over. The task goes on if the device has answered, its
/// replies are in order, and it does not want to be left in peace. Else the task ends:
///
///   the probe                     the task ends as
///   has failed                    the probe has
///   was refused, or unknown       no_reply: it was not sent
///   was answered with busy, ok    busy
///   its device is disabled now    no_reply
///
/// A good probe is not counted for a device that has been seen: that it answers probes does not
/// make up for polls that fail.
JobFinish::After JobFinish::Resume(Job& probe, const JobEnd& end, Instant now) {
  const auto& [outcome, reason] = end;
  Member& member = *probe.member;
  const bool life = ProvesLife(outcome);
  if (member.device != nullptr) tracker_.PlanBackground(*member.device);
  if (!life || member.health.state() == DeviceState::never_seen) {
    tracker_.OnTask(member, outcome, reason, now);
  }
  std::unique_ptr<Job> job = std::move(probe.postponed);
  job->proved = true;
  job->wire += probe.wire;
  // A device that wants to be left in peace gets it: a meter counts wrong passwords.
  const bool in_peace = schedule_.held_until(member.place) > now;
  const bool is_write = job->As<Job::Write>() != nullptr;
  const bool allowed = !in_peace || (is_write && outcome == Outcome::ok);
  NextStep next;
  if (life && member.in_use && whose_.MayBeInStep(job->asked()) && allowed) {
    next = job->has_news() ? NextStep::TakeAnswer() : GoOn(*job);  // only its proof was awaited
  } else if (!member.in_use) {
    next = EndUnproved(*job, Outcome::no_reply, "the device is disabled", now);
  } else if (outcome == Outcome::refused || outcome == Outcome::unsupported) {
    next = EndUnproved(*job, Outcome::no_reply, "the probe before it was answered: " + reason, now);
  } else {
    next = EndUnproved(*job, outcome == Outcome::ok ? Outcome::busy : outcome, reason, now);
  }
  return {std::move(job), std::move(next)};
}

JobFinish::After JobFinish::GoUnproved(std::unique_ptr<Job> probe, const std::string& why,
                                       Instant now) {
  std::unique_ptr<Job> job = std::move(probe->postponed);
  job->unprovable = true;
  whose_.OnNoProof(*job->member->device, now);
  NextStep next = job->has_news() ? EndUnproved(*job, Outcome::busy, why, now) : GoOn(*job);
  return {std::move(job), std::move(next)};
}

}  // namespace baudgate::bus
