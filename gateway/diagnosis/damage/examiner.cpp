// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/examiner.h"

#include <algorithm>
#include <string>
#include <utility>

#include "gateway/diagnosis/damage/other_service.h"
#include "gateway/diagnosis/damage/words.h"

namespace baudgate {

void Examiner::Begin(const Member& member, const Request& request, const LineTimes& times,
                     Instant now) {
  Bytes unanswered;  // what came to its last request
  if (exchange_.member() == &member) unanswered = exchange_.TakeHeard();
  exchange_.Begin(member, request, times, now);
  earlier_.OnBegin(exchange_, std::move(unanswered));
}

void Examiner::Hear(View bytes, Instant now) {
  if (exchange_.member() == nullptr) greeting_.OnBytes(bytes);
  exchange_.Hear(bytes, now);
}

Finding Examiner::End(Outcome outcome) {
  exchange_.End(outcome);
  if (exchange_.member() == nullptr) return {};
  if (ProvesLife(outcome)) OnAnswered();
  earlier_.OnEnd(exchange_);
  const bool plain = ProvesLife(outcome) && exchange_.heard().size() == exchange_.frame().size();
  Finding finding = plain ? Plain(exchange_.AsHearing(roster_)) : Look();
  finding = Greet(LookAgain(std::move(finding)));
  finding.idle = exchange_.idle();
  finding.asked = SpecialsOf(exchange_.request().bytes);
  told_ = finding.symptom;
  if (finding.symptom == Symptom::tail_lost || finding.symptom == Symptom::end_lost) {
    earlier_.OnBroken(exchange_);
  }
  return finding;
}

void Examiner::OnAnswered() {
  earlier_.OnAnswered(exchange_);
  habits_.OnAnswered(exchange_);
  negotiated_ = IsTelnet(greeting_.OnAnswered(exchange_.heard())) && roster_.is_network();
}

/// The same came to other requests before.
Finding Examiner::LookAgain(Finding finding) {
  const Bytes& heard = exchange_.heard();
  const bool right = IsAnswered(finding.symptom);
  // A Modbus TCP reply says by its number that it is another one's.
  const bool told = exchange_.member()->protocol->tcp && !finding.remedy.empty();
  const bool same = habits_.NoteSame(exchange_, exchange_.outcome() == Outcome::ok);
  if (!same || right || told) return finding;
  const bool text = std::ranges::all_of(heard, IsPrintable);
  return {.symptom = Symptom::same_again,
          .bytes = heard.size(),
          .cause = text ? Quote(heard) : std::string()};
}

/// A greeting of the connection may say why no device answers.
Finding Examiner::Greet(Finding finding) {
  const Bytes& heard = exchange_.heard();
  const bool speaks =
      finding.symptom == Symptom::text ||
      (roster_.is_network() && OtherService(heard, exchange_.member()->protocol->tcp));
  greeting_.OnEnd(heard, speaks);
  if (IsAnswered(finding.symptom) || greeting_.text().empty()) return finding;
  return Greeting(exchange_.AsHearing(roster_), greeting_.text()).value_or(finding);
}

std::optional<Finding> Examiner::More() {
  if (!exchange_.TakeMore()) return std::nullopt;
  Finding finding = Look();
  if (finding.symptom == told_) return std::nullopt;
  if (finding.symptom == Symptom::split) earlier_.OnMended();
  told_ = finding.symptom;
  return finding;
}

Finding Examiner::Look() {
  const bool rest = earlier_.FindRest(exchange_);
  const Hearing hearing = exchange_.AsHearing(roster_);
  Finding finding = Examine(hearing);
  if (rest && IsAnswered(finding.symptom)) return Plain(hearing);
  switch (finding.symptom) {
    case Symptom::other_master:
    case Symptom::master_beside:
      if (!earlier_.IsLateEcho(exchange_)) return finding;
      return {.symptom = Symptom::late_echo, .bytes = finding.bytes};
    case Symptom::others_beside:
    case Symptom::copies:
      if (earlier_.FindBeside(exchange_, finding)) return {};
      return habits_.IsCopy(exchange_) ? Finding{.symptom = Symptom::copies} : finding;
    case Symptom::bad_check:
    case Symptom::damaged:
    case Symptom::bytes_lost:
      return habits_.Compare(exchange_, std::move(finding));
    case Symptom::two_replies:
      if (habits_.IsCopy(exchange_)) return {.symptom = Symptom::copies};
      if (const auto late = earlier_.FindLostTry(*exchange_.member(), exchange_.last_came())) {
        return *late;
      }
      [[fallthrough]];
    case Symptom::other_device:
    case Symptom::other_reply:
    case Symptom::odd:
    case Symptom::other_form:
    case Symptom::noise_before:
    case Symptom::noise_behind:
    case Symptom::device_beside:
      return earlier_.Attribute(exchange_, std::move(finding));
    default:
      return finding;
  }
}

}  // namespace baudgate
