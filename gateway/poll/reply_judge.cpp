// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/reply_judge.h"

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
  Answer& answer = job.answer;
  answer = {};
  if (may_be_echo) {
    answer.reason =
        "a good reply equals its request, and this bus echoes requests: perhaps nobody has "
        "answered; set 'echo: strip' at the line";
    return answer.outcome = Outcome::unexpected;
  }
  Device* const device = job.member->device;
  const bool routed = job.As<Job::Routed>() != nullptr;
  Outcome outcome =
      routed ? JudgeRouted(job, frame) : device->conversation->Check(job.request.bytes, frame);
  if (device == nullptr) return answer.outcome = outcome;
  // A form that was not asked for, as where a profile is wrong, and yet its own.
  if (!routed && outcome == Outcome::unexpected && whose_reply_.MayBeOdd(job.asked())) {
    outcome = device->conversation->Interpret(job.request.bytes, frame).outcome;
  }
  if (ProvesLife(outcome) || outcome == Outcome::unexpected) {
    job.verdict = whose_reply_.OnReply(job.asked(), frame, outcome);
  }
  if (!ProvesLife(outcome)) return routed ? answer.outcome = outcome : Refuse(job, frame, outcome);
  const bool asks = !routed && !job.is_probe();
  if (job.verdict.elsewhere || (asks && !job.verdict.proven)) {
    answer.reason =
        "the reply may belong to an earlier request; it is asked again until that is certain";
    job.doubted = true;
    if (outcome != Outcome::ok && !routed) {
      Answer said = device->conversation->Interpret(job.request.bytes, frame);
      job.said = std::move(said.reason);
      job.says = outcome;
      answer.remedy = std::move(said.remedy);
    }
    return answer.outcome = Outcome::unexpected;
  }
  if (routed) return answer.outcome = outcome;
  const bool planned = IsPlanned(job.task, *device->conversation);
  answer = planned ? device->conversation->OnFrame(job.task, job.request, frame, now)
                   : device->conversation->Interpret(job.request.bytes, frame);
  // What a probe reads may be nobody's, and a query that no longer exists was not checked.
  if (!planned || !job.verdict.proven) {
    answer.readings.clear();
    answer.batch.reset();
  }
  return answer.outcome;
}

/// Not a good reply, in the words of its conversation.
Outcome ReplyJudge::Refuse(Job& job, View frame, Outcome outcome) {
  Answer said = job.member->device->conversation->Interpret(job.request.bytes, frame);
  job.answer.reason = std::move(said.reason);
  job.answer.remedy = std::move(said.remedy);
  if (job.answer.reason.empty()) {
    job.answer.reason = Quoted(job.request, frame) + "not the form that was asked for";
    job.answer.reason += "; does the profile fit?";
  }
  return job.answer.outcome = outcome;
}

/// Where nothing else is owed, a reply of the right slave and function is the reply, whatever its
/// form: Enron's registers of 32 bits, a device that limits what is written. Only a write that
/// comes back whole may be the bus.
Outcome ReplyJudge::JudgeRouted(Job& job, View frame) {
  Job::Routed& routed = *job.As<Job::Routed>();
  const PduCarrier& carrier = *job.member->protocol->carrier;
  const Bytes& request = job.request.bytes;
  const Outcome outcome = carrier.unwrap(request, frame, routed.reply);
  routed.older = {};
  if (outcome != Outcome::unexpected) {
    const auto fits = [&](const Bytes& lost) {
      Bytes pdu;
      return ProvesLife(carrier.unwrap(lost, frame, pdu));
    };
    routed.older = whose_reply_.lost().MayBe(*job.member, request, job.sent_at, fits);
    return outcome;
  }
  routed.odd = true;
  const bool may_be_bus = !echo_free_ && std::ranges::equal(frame, request);
  const bool its_own = !routed.reply.empty() && whose_reply_.IsOwedAlone(job.asked());
  return its_own && !may_be_bus ? Outcome::ok : outcome;
}

void ReplyJudge::OnEnd(const Job& job, const ExchangeEnd& end, bool echoed, Finding& finding) {
  const bool answered = ProvesLife(end.outcome);
  if (answered && !job.request.expect.mirrors) echo_free_ = !echoed;
  const std::string& reason = job.answer.reason.empty() ? end.reason : job.answer.reason;
  const bool refuses = answered && end.outcome != Outcome::ok;
  finding.outcome = end.outcome;
  finding.ended = end.ended;
  if (refuses || (job.doubted && !job.said.empty())) {
    finding.symptom = Symptom::refusal;
    if (!refuses) finding.outcome = job.says;
    finding.cause = refuses ? reason : job.said;
    finding.remedy = job.answer.remedy;
  } else if (job.doubted) {
    finding.symptom = Symptom::doubted;
  } else if (finding.symptom == Symptom::clean && !reason.empty() && !job.answer.remedy.empty()) {
    finding.symptom = Symptom::no_number;
    finding.cause = job.answer.reason;
    finding.remedy = job.answer.remedy;
  } else if (finding.symptom == Symptom::clean && job.answer.no_number) {
    finding.symptom = Symptom::no_number;
    finding.cause = Printable(ToBytes(*job.answer.no_number));
  } else if (finding.symptom == Symptom::odd) {
    // Without a reason: the reply was good, and an earlier exchange has met it.
    if (reason.empty()) finding.symptom = Symptom::silence;
    finding.cause = reason;
    finding.remedy = job.answer.remedy;
  } else if (finding.symptom == Symptom::one_behind && finding.cause.empty()) {
    finding.cause = reason;
  }
}

}  // namespace baudgate
