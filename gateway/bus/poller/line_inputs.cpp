// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/line_inputs.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/base/time.h"

namespace baudgate {

namespace {

/// "'<1D:READY:4B' has "; empty: it is no text, or may repeat a password.
std::string Quoted(const Request& request, View frame) {
  const std::string_view text = Trim(AsText(frame));
  const bool printable = std::ranges::all_of(text, [](char c) { return c >= 0x20 && c < 0x7F; });
  if (text.empty() || !printable || !request.expect.secrets.empty()) return {};
  return "'" + std::string(text) + "' has ";
}

}  // namespace

Outcome ReplyJudge::Judge(Job& job, View frame, bool may_be_echo, Instant now) {
  const Request& request = job.step.request;
  Job::Attempt& attempt = job.attempt;
  Answer& answer = attempt.answer;
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
  Answer& answer = job.attempt.answer;
  auto& unproven = job.attempt.unproven;
  answer.reason =
      "the reply may belong to an earlier request; it is asked again until that is certain";
  unproven = Job::Unproven{};
  if (outcome != Outcome::ok && job.As<Job::Routed>() == nullptr) {
    Answer said = job.member->device->conversation->Interpret(job.step.request.bytes, frame);
    unproven = {.refusal = std::move(said.reason), .refused_as = outcome};
    answer.remedy = std::move(said.remedy);
  }
  return answer.outcome = Outcome::unexpected;
}

/// Its own, as its conversation reads it.
Outcome ReplyJudge::Read(Job& job, View frame, Instant now) {
  Conversation& conversation = *job.member->device->conversation;
  Answer& answer = job.attempt.answer;
  const bool planned = IsPlanned(job.task, conversation);
  answer = planned ? conversation.OnFrame(job.task, job.step.request, frame, now)
                   : conversation.Interpret(job.step.request.bytes, frame);
  job.unplanned = !planned;
  // What a probe reads may be nobody's, and a query that no longer exists was not checked.
  if (!planned || !job.attempt.verdict.proven) {
    answer.readings.clear();
    answer.batch.reset();
  }
  return answer.outcome;
}

/// Not a good reply, in the words of its conversation.
Outcome ReplyJudge::Refuse(Job& job, View frame, Outcome outcome) {
  const Request& request = job.step.request;
  Answer& answer = job.attempt.answer;
  Answer said = job.member->device->conversation->Interpret(request.bytes, frame);
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
  const PduCarrier& carrier = *job.member->protocol->carrier;
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
  const Answer& answer = job.attempt.answer;
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

void Reception::OnOpened() {
  judge_.OnOpened();
  echo_.OnOpened();
  observer_.OnOpened();
}

void Reception::OnSend(const Job& job, Instant now) {
  observer_.OnRequest(*job.member, job.step.request, now);
  echo_.OnSent(job.step.request.bytes);
}

EchoWatch::Received Reception::TakeOutEcho(View bytes, const Job* job, Instant now) {
  EchoWatch::Received heard =
      echo_.OnReceived(bytes, job != nullptr ? &job->step.request : nullptr);
  if (!heard.bytes.empty()) observer_.Hear(heard.bytes, now);
  return heard;
}

Outcome Reception::Judge(Job& job, View frame, Instant now) {
  observer_.OnReply(frame);
  return judge_.Judge(job, frame, echo_.MayBeEcho(job.step.request, frame), now);
}

Reception::Seen Reception::Assess(const Job& job, ExchangeEnd& end) {
  Seen seen;
  seen.no_echo = echo_.OnExchangeEnd(job.step.request, end);
  seen.cut = echo_.is_cut();
  seen.finding = observer_.TakeFinding(end.outcome);
  seen.negotiates = observer_.TakeNegotiation();
  judge_.CompleteFinding(job, end, echo_.echoed(), seen.finding);
  return seen;
}

LineSide::LineSide(Reception& reception, const Standing* standing, JobRun& run, RequestPort& port)
    : reception_(reception), run_(run), port_(port) {
  if (standing != nullptr) line_.Listen(*standing);
}

// ---------------------------------------------------------------- inputs

void LineSide::OnOpened(Now now, bool keeps_bit_rate) {
  reception_.OnOpened();
  line_.OnOpened(now.instant, keeps_bit_rate);
}

void LineSide::OnPortClosed(const std::string& reason) {
  reception_.OnClosed();
  run_.OnClosed(reason);
}

LineSide::Received LineSide::FeedLine(View bytes, Instant now) {
  const Job* const job = run_.job();
  Received received{.member = job != nullptr ? job->member : nullptr,
                    .heard = reception_.TakeOutEcho(bytes, job, now),
                    .collided = {},
                    .news = {}};
  if (received.heard.collision) received.collided = line_.OnCollision(now);
  if (!received.heard.bytes.empty()) received.news = line_.Feed(received.heard.bytes, now);
  return received;
}

LineNews LineSide::OnTimer(Instant now) {
  Withdraw();  // the program may have been stopped since the line began to wait for its quiet
  return line_.OnTimer(now);
}

std::optional<Instant> LineSide::Deadline() const {
  const Job* const job = run_.job();
  const bool may_be_withdrawn = waits_for_quiet() && job != nullptr;
  return Soonest({line_.Deadline(), may_be_withdrawn ? LatestStart(*job) : std::nullopt});
}

Outcome LineSide::Judge(View frame, Instant now) {
  return reception_.Judge(*run_.job(), frame, now);
}

// ---------------------------------------------------------------- the request of the job

LineNews LineSide::Start(Instant idle_since, Instant now) {
  return line_.Start(run_.Start(idle_since), now);
}

void LineSide::Send(Now now) {
  const Request& request = run_.Send();
  reception_.OnSend(*run_.job(), now.instant);
  port_.Send(request.bytes, run_.job()->member->serial, now);
}

void LineSide::Withdraw() {
  if (waits_for_quiet() && run_.Withdraw()) line_.Cancel();
}

// ---------------------------------------------------------------- the end of its exchange

void LineSide::KeepEnd(ExchangeEnd end) {
  if (run_.job() != nullptr) run_.KeepEnd(std::move(end));
}

std::optional<LineSide::Over> LineSide::TakeEnd() {
  std::optional<ExchangeEnd> end = run_.TakeEnd();
  if (!end) return std::nullopt;
  const Job& job = *run_.job();
  Over over{.member = job.member, .end = std::move(*end), .seen = {}};
  over.seen = reception_.Assess(job, over.end);
  return over;
}

void LineSide::PassToJob(Over over) {
  if (!ProvesLife(over.end.outcome)) {
    const bool closed = over.end.outcome == Outcome::line_down;
    if (port_.IsUnsent()) {
      run_.NeverLeft();
      if (!closed) over.end.reason = kNotConnected;
    }
    if (!closed) port_.DropUnsent();
  }
  run_.FollowUp(std::move(over.end), over.seen.finding);
}

void LineInputs::OnTime(Now now) {
  arrival_.OnInput(now.instant, IsAwaiting());
  accounts_.OnTime(now, !line_.idle(), line_.member(), !line_.asks());
}

std::optional<Instant> LineInputs::Deadline() const {
  return Soonest(
      {line_.Deadline(), IsAwaiting() ? std::optional(arrival_.NextLook()) : std::nullopt});
}

void LineInputs::OnClosed(const std::string& reason, Now now) {
  LineNews news = line_.OnClosed();
  if (news.end) news.end->reason = reason;
  Apply(std::move(news), now);
  HandleEnd();
  line_.OnPortClosed(reason);
}

void LineInputs::HandleBytes(View bytes, Now now) {
  LineSide::Received received = line_.FeedLine(bytes, now.instant);
  const EchoWatch::Received& heard = received.heard;
  accounts_.line.OnHeard(heard, received.member);
  Apply(std::move(received.collided), now);
  if (heard.bytes.empty()) return;
  unasked_.Overhear(heard.bytes, now.instant);
  Apply(std::move(received.news), now);
}

/// A reply and a message are as old as they may be. No reply is older than its request.
void LineInputs::Date(LineNews& news, Instant now) const {
  for (UnaskedMessage& message : news.unasked.messages) {
    message.since = now - arrival_.Earliest(now - message.since);
  }
  if (!news.end) return;
  const Instant read = now - news.end->since_reply;
  news.end->since_reply = now - std::max(arrival_.Earliest(read), read - news.end->round_trip);
}

/// The news of one input, in their order. HandleEnd applies the end of an exchange.
void LineInputs::Apply(LineNews news, Now now) {
  Date(news, now.instant);
  unasked_.OnInput(news.unasked, now);
  if (news.send) Send(now);
  if (news.stray_before.count > 0) HandleStray(news.stray_before, now.instant);
  if (news.end) line_.KeepEnd(std::move(*news.end));
  if (news.stray.count > 0) HandleStray(news.stray, now.instant);
  if (news.second_reply) tracker_.OnSecondReply(now.instant);
}

void LineInputs::Send(Now now) {
  for (const EarlierFinding& changed : line_.TakeChanged()) {
    accounts_.devices.OnMore(*changed.member, changed.finding, changed.back);
    // The line's patience with this device does not grow: its neighbours would pay for it.
    if (changed.lateness > Duration::zero()) {
      tracker_.CountLate(*changed.member, changed.lateness, now.instant);
    }
  }
  line_.Send(now);
}

void LineInputs::HandleStray(const StrayBytes& stray, Instant now) {
  const LateReplies::StrayEffects effects = tracker_.ApplyStray(stray, now);
  if (effects.warned != nullptr) accounts_.line.Warn(*effects.warned, effects.warning);
}

void LineInputs::HandleEnd() {
  std::optional<LineSide::Over> over = line_.TakeEnd();
  if (!over) return;
  if (over->seen.no_echo) accounts_.line.OnNoEcho();
  accounts_.line.OnRing(*over->member, over->seen.cut);
  if (over->seen.negotiates) accounts_.line.OnNegotiation();
  line_.PassToJob(std::move(*over));
}

}  // namespace baudgate
