// The state table of `Job`. The functions follow in the order of the life of a job. A late reply is
// the reply to an earlier request (gateway/bus/replies/late_replies.h). A postponed job waits for a
// probe of its device. A proof is the answer to a probe; it shows that replies come in order.
//
// clang-format off
//   the job               what happens                        next
//   chosen, or parked     the conversation gives a request,   waiting
//                         or its request is ready
//   chosen                the conversation has no request     ended: unsupported
//   waiting: a poll,      a late reply of its device may      parked, if replies carry addresses:
//   read-back, events,    come                                WaitsBesideLine
//   or background read
//   waiting: other kinds, a late reply may come               the line waits: NextStep::hold
//   or no addresses
//   waiting               line idle; the reply to an earlier  postponed behind a probe of its device
//                         request could be taken for its own
//   waiting               line idle; no late reply can come   under way (quiet, sending, receiving)
//   waiting, quiet        its deadline passed, its client     broken off: it closes what it has opened,
//                         left, its device was disabled, or   then ends as not_sent or denied; as unknown
//                         an interlock forbids the write      if it may have written
//   quiet: a routed read  a start or stop came                back in its queue
//   under way             a good reply; a request remains     waiting, for the next request
//   under way             a good reply; no request remains    ended with the outcome of the reply
//   under way             a good reply with events or         postponed behind a probe of its device,
//                         readings, to a repetition or        if the device has a name: Answer
//                         after a failed exchange
//   under way             a broadcast is sent; a request      waiting, for the next request
//                         remains
//   under way: a poll or  the device answers busy             parked, as often as there are retries,
//   a read-back                                               unless a job like it is parked: ParkedJobs
//   under way: a read     a good reply that may answer a      waiting, to be repeated; a routed read as
//                         much older request                  well
//   under way: a probe    a good reply that may answer the    waiting, to be repeated, before the
//                         probe of an earlier task            postponed job continues
//   under way, not routed silence, damage, or the reply to    waiting, to be repeated: MayRepeat
//                         another request
//   under way, not routed a failure; no retry is left         a request that closes what is open; or ended
//   under way: a routed   damage                              back in its queue, as often as there are
//   read                                                      retries
//   under way, routed     silence, damage, or the reply to    ended: its client decides
//                         another request
//   under way             the port is lost                    ended: line_down
//   postponed             its probe cannot be asked           waiting, without a proof; ended as busy if
//                                                             its reply has come and waits for the proof
//   postponed             its probe was answered in order     waiting; or its reply counts, if it has come
//   postponed             its probe failed, or was answered   ended as the probe (as busy if that was ok); as
//                         out of order                        not sent if the probe was refused
//   a write, ended ok     points of its command remain        chosen, with the next point
//   a write, ended ok     no point remains                    confirmed: answered after the read-back
// clang-format on
//
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job.h"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/bus/jobs/line_context.h"

namespace baudgate::bus {

// ---------------------------------------------------------------- Ask: the next request

namespace {

/// True if the query of the task still exists. Example of the contrary: a poll of query 7 waits for
/// a probe, and after the reply to the probe the device has 5 queries only.
bool IsPlanned(const protocols::Task& task, const protocols::Conversation& conversation) {
  if (task.kind == protocols::Task::Kind::events) return conversation.HasEvents();
  if (task.kind == protocols::Task::Kind::background)
    return conversation.BackgroundDue().has_value();
  return task.kind != protocols::Task::Kind::poll || task.query < conversation.Queries().size();
}

}  // namespace

NextStep Job::Ask(LineContext& line, int repeats, Instant now) {
  if (++requests > protocols::kMostSteps) {
    return NextStep::Finish(Outcome::unexpected,
                            "the poll or write was ended, because it needed more than " +
                                std::to_string(protocols::kMostSteps) + " requests");
  }
  protocols::Conversation& conversation = *member->device->conversation;
  FollowPlan();
  if (!IsPlanned(task, conversation)) {
    judges_member = false;
    unplanned = true;
    return NextStep::Finish(Outcome::busy,
                            "this poll no longer exists, because the points of the device are now "
                            "polled in other groups");
  }
  auto request = conversation.Ask(task, now);
  if (!request) {
    judges_member = false;
    has_no_request = true;
    if (!is_probe()) line.accounts.devices.OnUnsupported(*member, request.error());
    return NextStep::Finish(Outcome::unsupported, request.error());
  }
  if (probe_budget == Probes::Kind::rested_look) {
    request->quiet = std::max(request->quiet, Probes::kRest);
  }
  step = {.request = std::move(*request), .waiting = true, .repeats = repeats};
  return NextStep::Wait();
}

// ---------------------------------------------------------------- Depart: is the request sent now?

std::optional<Withheld> Job::WhyNotSend(Instant now, bool /*held*/) const {
  if (step.request.closes) return std::nullopt;
  if (!is_routed() && !member->in_use) {
    return Withheld{WriteEnd::not_sent,
                    "the device is disabled; 'baudgate enable' takes it into use"};
  }
  const auto latest = LatestStart();
  if (latest && *latest <= now) return Withheld{WriteEnd::not_sent, kTooLate};
  return std::nullopt;
}

/// Ends a job whose waiting request must not be sent. If the job has sent a request before, the
/// conversation can first send a request that closes what was opened.
NextStep Job::BreakOff(const Withheld& withheld, Instant now) {
  judges_member = false;
  OnWithheld(withheld);
  if (!is_routed() && begun()) {
    protocols::Conversation& conversation = *member->device->conversation;
    const protocols::Then then = conversation.OnFailure(task, step.request, Outcome::busy, now);
    if (then == protocols::Then::ask_again) return NextStep::Ask();
  }
  return NextStep::Finish(Outcome::no_reply, withheld.why);
}

/// True if the job is to be parked (ParkedJobs) while a late reply of its device may come, so that
/// the line can do other work. Only reads are parked, only if replies carry addresses, and only if
/// no similar job is parked.
bool Job::WaitsBesideLine(const LineContext& line) const {
  const bool reads = task.kind == protocols::Task::Kind::poll ||
                     task.kind == protocols::Task::Kind::events ||
                     task.kind == protocols::Task::Kind::background;
  return reads && asked().named() && !line.agenda.parked.HasLike(*this);
}

NextStep Job::Depart(LineContext& line, Instant now) {
  if (const auto withheld = WhyNotSend(now)) return BreakOff(*withheld, now);
  WhoseReply& whose = line.owed.whose;
  whose.Recognise(*member, step.request.expect.address);
  if (whose.NeedsProbeFirst(asked(), now)) {
    const Device& device = *member->device;
    if (!writes() || !whose.IsProbedByWrites(device)) return NextStep::ProbeFirst();
    unprovable = true;
    whose.OnNoProof(device, now);
  }
  // A retry is sent at once: a late reply to the first try answers the retry as well.
  const Instant clear = line.owed.late_replies.ClearAt(asked());
  if (step.repeats > 0 || clear <= now) return NextStep::Send();
  return WaitsBesideLine(line) ? NextStep::Park(clear) : NextStep::Hold();
}

std::optional<Instant> Job::DepartsAt(const LineContext& line) const {
  const bool repeats = step.repeats > 0;
  return Soonest({repeats ? std::nullopt : std::optional(line.owed.late_replies.ClearAt(asked())),
                  goal().LatestStart()});
}

std::optional<NextStep> Job::Withdraw(LineContext& line, Instant now) {
  if (const auto withheld = WhyNotSend(now)) return BreakOff(*withheld, now);
  return LetsPass(line, now) ? std::optional(NextStep::BackInQueue()) : std::nullopt;
}

// ---------------------------------------------------------------- Start, Send: the request is sent

Asked Job::asked() const {
  const bool alone = &goal() == this;
  return {.member = member,
          .request = &step.request,
          .sent = attempt.sent_at,
          .first = requests == 1 + broadcasts && step.repeats == 0 && !is_probe(),
          .retry = step.repeats > 0,
          .probe = is_probe(),
          .lone_probe = is_probe() && alone,
          .renews_proof_early = renews_proof_early,
          .proved = proved,
          .unprovable = unprovable,
          .writes = writes()};
}

Exchange Job::Start(LineContext& line, Instant idle_since, Instant now) {
  const Device* const device = member->device;
  const bool trusted = device != nullptr && device->config->trust_order;
  step.waiting = false;
  attempt = {.began = now, .sent_at = now, .job_was_sent = was_sent};
  return line.owed.ExchangeOf(asked(), trusted, idle_since, now);
}

const protocols::Request& Job::Send(LineContext& line, Now now) {
  protocols::Request& request = step.request;
  if (request.stamped) {
    const Duration character = member->times.character;
    const Duration takes = TransmissionTime(request, character);
    member->device->conversation->Stamp(request, {now.instant + takes, now.wall + takes},
                                        character);
  }
  OnSend(line, now.instant);
  line.agenda.turns.OnSent(goal().is_urgent());
  line.owed.whose.OnSent(asked(), now.instant);
  if (probe_budget && !was_sent) line.accounts.line.OnProbe();
  line.accounts.line.OnSent(*member, request);
  attempt.sent_at = now.instant;
  was_sent = true;
  return request;
}

// ---------------------------------------------------------------- Judge: a frame has come

namespace {

/// Returns the frame as text for a message, such as "'<1D:READY:4B' has ". If the frame is not a
/// text, or could contain a password, returns "the reply has ".
std::string Quoted(const protocols::Request& request, View frame) {
  const std::string_view text = Trim(AsText(frame));
  const bool printable = std::ranges::all_of(text, [](char c) { return c >= 0x20 && c < 0x7F; });
  if (text.empty() || !printable || !request.expect.secrets.empty()) return "the reply has ";
  return "'" + std::string(text) + "' has ";
}

}  // namespace

Outcome Job::Judge(LineContext& line, View frame, const EchoWatch& echo, Instant now) {
  protocols::Answer& answer = attempt.answer;
  if (echo.MayBeEcho(step.request, frame)) {
    answer.reason =
        "the reply equals the request, and this bus echoes requests, so perhaps no device has "
        "answered; set 'echo: strip' at the line";
    return answer.outcome = Outcome::unexpected;
  }
  FollowPlan();
  const Outcome outcome = JudgeForm(line, frame, echo);
  if (member->device == nullptr) return answer.outcome = outcome;
  const bool says_whose = ProvesLife(outcome) || outcome == Outcome::unexpected;
  if (says_whose) attempt.verdict = line.owed.whose.OnReply(asked(), frame, outcome);
  if (!ProvesLife(outcome)) return Refuse(frame, outcome);
  const bool asks = !is_routed() && !is_probe();
  if (attempt.verdict.elsewhere || (asks && !attempt.verdict.proven)) {
    return LeaveUnproven(frame, outcome);
  }
  return Read(frame, now);
}

Outcome Job::JudgeForm(LineContext& line, View frame, const EchoWatch& /*echo*/) {
  protocols::Conversation& conversation = *member->device->conversation;
  const Outcome outcome = conversation.Check(step.request.bytes, frame);
  // A reply of an unexpected form is used if no other reply can come now. The configured profile
  // may not fit the device.
  if (outcome == Outcome::unexpected && line.owed.whose.MayBeOdd(asked())) {
    return conversation.Interpret(step.request.bytes, frame).outcome;
  }
  return outcome;
}

/// Ends the exchange as `unexpected`, because the reply may belong to an earlier request. If the
/// reply is a refusal, its reason is stored.
Outcome Job::LeaveUnproven(View frame, Outcome outcome) {
  protocols::Answer& answer = attempt.answer;
  answer.reason = "the reply may belong to an earlier request, so it is not used";
  attempt.unproven = Unproven{};
  if (outcome != Outcome::ok && !is_routed()) {
    protocols::Answer said = member->device->conversation->Interpret(step.request.bytes, frame);
    attempt.unproven = {.refusal = std::move(said.reason), .refused_as = outcome};
    answer.remedy = std::move(said.remedy);
  }
  return answer.outcome = Outcome::unexpected;
}

Outcome Job::Read(View frame, Instant now) {
  protocols::Conversation& conversation = *member->device->conversation;
  protocols::Answer& answer = attempt.answer;
  const bool planned = IsPlanned(task, conversation);
  answer = planned ? conversation.OnFrame(task, step.request, frame, now)
                   : conversation.Interpret(step.request.bytes, frame);
  unplanned = !planned;
  // Readings and events are dropped if the query no longer exists, or if the reply may belong to
  // another request.
  if (!planned || !attempt.verdict.proven) {
    answer.readings.clear();
    answer.batch.reset();
  }
  return answer.outcome;
}

/// Stores why the reply is not good, as the conversation explains it. Returns `outcome`.
Outcome Job::Refuse(View frame, Outcome outcome) {
  protocols::Answer& answer = attempt.answer;
  protocols::Answer said = member->device->conversation->Interpret(step.request.bytes, frame);
  answer.reason = std::move(said.reason);
  answer.remedy = std::move(said.remedy);
  if (answer.reason.empty()) {
    answer.reason = Quoted(step.request, frame) + "an unexpected form";
    answer.reason += "; check that the profile fits the device";
  }
  return answer.outcome = outcome;
}

// ---------------------------------------------------------------- the exchange has ended

EndedExchange Job::Ended(ExchangeEnd end) const {
  EndedExchange ended{.member = member,
                      .asked = asked(),
                      .end = std::move(end),
                      .began = attempt.began,
                      .use = use(),
                      .broadcast = is_broadcast(),
                      .routed = is_routed(),
                      .polls = task.kind == protocols::Task::Kind::poll,
                      .answer = &attempt.answer,
                      .verdict = attempt.verdict,
                      .unproven = attempt.unproven ? &*attempt.unproven : nullptr};
  if (!ended.cut_off() && !attempt.answer.reason.empty()) ended.end.reason = attempt.answer.reason;
  return ended;
}

/// Call when a request was sent. If it was a broadcast, which gets no reply, asks the conversation
/// whether the task has a further request, and returns the answer.
bool Job::GoesOnBehindBroadcast(Instant now) {
  if (!is_broadcast() || is_routed()) return false;
  protocols::Conversation& conversation = *member->device->conversation;
  if (conversation.OnSent(task, step.request, now) != protocols::Then::ask_again) return false;
  ++broadcasts;
  return true;
}

NextStep Job::Conclude(LineContext& line, const ExchangeEnd& end, Now now) {
  const bool answered = ProvesLife(end.outcome);
  judges_member = !is_broadcast();
  if (answered) wire += now.instant - attempt.began;
  if (end.outcome == Outcome::line_down) return NextStep::Finish(end.outcome, end.reason);
  if (answered && GoesOnBehindBroadcast(now.instant)) return NextStep::Ask(step.repeats);
  return answered ? Answer(line, end, now) : Fail(line, end, now.instant);
}

NextStep Job::Repeat() {
  ++step.repeats;
  step.waiting = true;
  return NextStep::Wait();
}

// ---------------------------------------------------------------- Answer: the request is answered

/// Accepts a good reply. After a retry or a failed exchange of the job, another device may have
/// answered. If the device has a name, new values and events then wait for a probe that asks for
/// this name.
NextStep Job::Answer(LineContext& line, const ExchangeEnd& end, Now now) {
  attempt.answered_at = {now.instant - end.since_reply, now.wall - end.since_reply};
  attempt.round_trip = end.round_trip;
  attempt.after_reply_time = LateReplies::Lateness(asked(), end) > Duration::zero();
  if (attempt.verdict.replaced) OnReplaced(line, now);
  if (MustRepeat(line, now.instant)) return Repeat();
  const bool in_doubt = has_news() && (had_failure || step.repeats > 0);
  if (in_doubt && line.owed.whose.HasName(*member)) return NextStep::ProbeFirst();
  return Take(line, now.instant);
}

void Job::OnReplaced(LineContext& line, Now now) {
  line.tracker.OnReplaced(*member->device, now);
  line.intake.OnReplaced(*member->device);
}

/// True if a poll has to be sent again: the replies of the device come some requests late, and this
/// reply may answer a request that is older than the ceiling (LineTimes).
bool Job::MustRepeat(const LineContext& line, Instant now) const {
  const bool reads = task.kind == protocols::Task::Kind::poll && !attempt.answer.readings.empty();
  const bool much_older =
      line.owed.whose.Lags(*member) && attempt.verdict.older > member->times.ceiling;
  return reads && step.request.expect.repeatable && much_older &&
         MayRepeat(line, kMostTriesMore, now);
}

NextStep Job::Take(LineContext& line, Instant now) {
  Device& device = *member->device;
  protocols::Answer answer = std::exchange(attempt.answer, {});
  line.tracker.OnHeard(device, now);
  NoteTold({answer.outcome, answer.reason}, answer.may_have_acted);
  const Outcome outcome = answer.outcome;
  const Duration wait = answer.wait;
  const protocols::Then then = answer.then;
  const std::string reason = answer.reason;
  for (const protocols::Reading& reading : answer.readings) {
    if (HasValue(reading.value) && reading.point != protocols::kNoPoint)
      device.heard.OnValue(reading.point, now);
  }
  TakeOver(line, device, std::move(answer), now);
  if (then == protocols::Then::ask_again) return NextStep::Ask();
  if (then == protocols::Then::replan) line.tracker.GoOnWithPlan(device, now);
  if (then == protocols::Then::restart) line.tracker.RestartWithPlan(device, now);
  const bool same_plan = then != protocols::Then::replan && then != protocols::Then::restart;
  if (!same_plan || !ParksBusy(line, outcome)) return NextStep::Finish(outcome, reason);
  ++parkings;
  --requests;
  return NextStep::Park(now + std::max<Duration>(wait, device.times.quiet));
}

void Job::TakeOver(LineContext& line, Device& device, protocols::Answer answer, Instant now) {
  const ReplyEffects effects = line.intake.Take(*this, device, std::move(answer), now);
  if (effects.rechecked) line.accounts.devices.OnRecheck(device);
  if (effects.unconfirmed) line.accounts.devices.OnUnconfirmed(device);
  for (const QueryRef& query : effects.read_soon) line.agenda.write_queue.AddReadBack(query);
  for (const config::Group group : effects.repeat) line.tracker.Repeat(device, group, false, now);
  if (effects.stored) line.owed.readings.OnStored(*effects.stored);
  if (effects.hold_events) {
    line.agenda.schedule.HoldEvents(device.place);
    line.agenda.background.AwaitDisk(device.place);
  }
  if (effects.peace > Duration::zero())
    line.agenda.schedule.Hold(device.place, now + effects.peace);
}

bool Job::ParksBusy(const LineContext& line, Outcome outcome) const {
  return outcome == Outcome::busy && task.kind == protocols::Task::Kind::poll &&
         parkings < member->max_retries && member->in_use && !line.agenda.parked.HasLike(*this);
}

// ---------------------------------------------------------------- Fail: after a failed exchange

NextStep Job::Fail(LineContext& line, const ExchangeEnd& end, Instant now) {
  const bool heard_itself = attempt.answer.outcome == Outcome::unexpected;
  attempt.answer = {};
  had_failure = true;
  // The reply to an earlier request came. Further such replies may come first, and one retry more
  // is allowed for each. If the device answered this request in an unexpected form, no such reply
  // came.
  const bool nearer = end.outcome == Outcome::unexpected && !attempt.verdict.odd;
  const int before = nearer ? line.owed.whose.RepliesBefore(asked(), heard_itself) : 0;
  if (!MayRepeat(line, std::min(before, kMostTriesMore), now)) return GiveUp(line, end, now);
  protocols::Request& request = step.request;
  const auto instead = member->device->conversation->Instead(request, end.outcome, now);
  if (!instead && (!request.expect.repeatable || !request.context.empty())) {
    return GiveUp(line, end, now);
  }
  if (instead) request = *instead;
  line.accounts.devices.OnRetry(*member);
  return Repeat();
}

bool Job::MayRepeat(const LineContext& line, int more, Instant now) const {
  const bool looked_for = is_probe() && &goal() == this;
  const bool once = looked_for || member->health.state() == DeviceState::never_seen;
  if (step.repeats >= (once ? 0 : member->max_retries) + more) return false;
  if (const auto until = goal().RepeatsUntil()) return now < *until;
  return line.chooser.MayRepeat(*this, more, now);
}

NextStep Job::GiveUp(LineContext& line, const ExchangeEnd& end, Instant now) {
  FollowPlan();
  Device& device = *member->device;
  const auto queries = device.conversation->Queries();
  const bool silent = task.kind == protocols::Task::Kind::poll && end.outcome == Outcome::no_reply;
  blames_query = silent && task.query < queries.size() &&
                 !device.heard.TellsOfDevice(queries[task.query].points, now);
  OnGaveUp(end);
  const protocols::Then then = device.conversation->OnFailure(task, step.request, end.outcome, now);
  line.tracker.OnHeard(device, now);
  if (then == protocols::Then::ask_again) return NextStep::Ask();
  if (then == protocols::Then::replan) line.tracker.GoOnWithPlan(device, now);
  line.tracker.HoldBack(device);
  return NextStep::Finish(end.outcome, end.reason);
}

// ---------------------------------------------------------------- the end of the job

NextStep Job::GoOn() {
  requests = broadcasts = 0;
  return NextStep::Ask();
}

EndEffects Job::EffectsOf(const JobEnd& end, Instant now) {
  EndEffects effects;
  // A device that answers in an unexpected form is not absent, so the failure does not count for
  // its state.
  effects.judges_member = judges_member && !attempt.verdict.odd;
  End(end, now, effects);
  return effects;
}

Job::After Job::Finish(LineContext& line, const JobEnd& end, Instant now) {
  FollowPlan();  // the answer may have changed the queries of the device
  EndEffects effects = EffectsOf(end, now);
  Apply(line, effects, end, now);
  return {};
}

void Job::Apply(LineContext& line, EndEffects& effects, const JobEnd& end, Instant now) {
  Agenda& agenda = line.agenda;
  Accounts& accounts = line.accounts;
  DeviceTracker& tracker = line.tracker;
  Device* const device = member->device;
  if (const auto& background = effects.background; background && background->sent) {
    agenda.background.NoteEnd(member->place, background->took, background->proved);
  } else if (background) {
    agenda.background.OnUnsent(member->place);
  }
  if (device != nullptr) tracker.PlanBackground(*device);
  if (probe_budget) agenda.probes.NoteEnd(*member, *probe_budget, began);
  if (effects.fast_poll) accounts.rounds.OnPoll(*member, *effects.fast_poll, now);
  if (effects.poll) {
    const auto& [query, answered] = *effects.poll;
    accounts.devices.OnPoll(*device, query, answered, had_failure);
    line.observer->OnPoll(*device, query);
  }
  if (effects.repeat) tracker.Repeat(*device, effects.repeat->group, effects.repeat->soon, now);
  if (!effects.read_again.empty()) tracker.ReadBack(*device, effects.read_again);
  if (!effects.doubt.empty() && member->in_use) tracker.Doubt(*device, effects.doubt, now);
  if (effects.polls_first && device != nullptr) agenda.schedule.GoFirst(member->place);
  // If only this query is never answered, the device does not have its points, but is not absent.
  if (effects.judges_member && !blames_query) {
    tracker.OnTask(*member, end.outcome, end.reason, now);
  }
  if (effects.wrote) {
    tracker.OnWritten(*member->protocol, step.request.bytes, device, effects.written,
                      ProvesLife(end.outcome), now);
  }
  for (auto& [request, reply] : effects.replies) request.done(std::move(reply));
}

}  // namespace baudgate::bus
