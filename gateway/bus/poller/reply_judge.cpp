// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/reply_judge.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "gateway/base/text.h"

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
    return Doubt(job, frame, outcome);
  }
  return routed ? answer.outcome = outcome : Read(job, frame, now);
}

/// It may belong to an earlier request.
Outcome ReplyJudge::Doubt(Job& job, View frame, Outcome outcome) {
  Answer& answer = job.attempt.answer;
  auto& doubt = job.attempt.doubt;
  answer.reason =
      "the reply may belong to an earlier request; it is asked again until that is certain";
  doubt = Job::Doubt{};
  if (outcome != Outcome::ok && job.As<Job::Routed>() == nullptr) {
    Answer said = job.member->device->conversation->Interpret(job.step.request.bytes, frame);
    doubt = {.refusal = std::move(said.reason), .refused_as = outcome};
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

void ReplyJudge::OnEnd(const Job& job, const ExchangeEnd& end, bool echoed, Finding& finding) {
  const bool answered = ProvesLife(end.outcome);
  if (answered && !job.step.request.expect.mirrors) echo_free_ = !echoed;
  const Answer& answer = job.attempt.answer;
  const auto& doubt = job.attempt.doubt;
  const std::string& reason = answer.reason.empty() ? end.reason : answer.reason;
  const bool refuses = answered && end.outcome != Outcome::ok;
  finding.outcome = end.outcome;
  finding.ended = end.ended;
  // The form of the reply to an earlier request; but the order of replies is proven.
  const bool proven = job.attempt.verdict.odd && finding.symptom == Symptom::one_behind;
  if (proven) finding.symptom = Symptom::odd;
  if (refuses || (doubt && !doubt->refusal.empty())) {
    finding.symptom = Symptom::refusal;
    if (!refuses) finding.outcome = doubt->refused_as;
    finding.cause = refuses ? reason : doubt->refusal;
    finding.remedy = answer.remedy;
  } else if (doubt) {
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

}  // namespace baudgate
