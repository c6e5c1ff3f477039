// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/reply_habits.h"

#include <algorithm>
#include <utility>

#include "protocols/assembler.h"
#include "protocols/transaction.h"

namespace baudgate {

void ReplyHabits::OnLost(const Member& member, Instant tried) {
  State& state = of_[member];
  state.lost = tried;
  state.since = 1;
}

void ReplyHabits::OnAnswered(const HeardExchange& exchange) {
  const Bytes& request = exchange.request().bytes;
  TakenReply& misfit = of_[*exchange.member()].misfit;
  if (misfit.request == request) misfit = {};
  taken_.Add(request, exchange.frame());
}

std::optional<ReplyHabits::LostTry> ReplyHabits::TakeLostTry(const Member& member, Instant came) {
  State& state = of_[member];
  const Duration after = came - state.lost;
  const bool lost = state.lost != Instant{} && after < kLongestLag;
  if (!lost) state.doubles = true;
  if (!lost || state.doubles) return std::nullopt;
  state.lost = {};
  return LostTry{after, state.since};
}

bool ReplyHabits::NoteSame(const HeardExchange& exchange, bool right) {
  const Member& member = *exchange.member();
  const View heard = exchange.heard();
  const View came = heard.subspan(std::min(heard.size(), TransactionBytes(*member.protocol)));
  // Texts of other values may well be alike; the length of a PDU follows from its request.
  const bool misfit = !ProvesLife(exchange.outcome()) && member.protocol->carrier != nullptr;
  return of_[member].same.OnCame(came, exchange.request().bytes, right, misfit,
                                 member.protocol->tcp);
}

bool ReplyHabits::IsCopy(const HeardExchange& exchange) const {
  Assembler assembler;
  assembler.Begin(exchange.member()->protocol->reply_rule, exchange.request().expect);
  assembler.Feed(exchange.heard());
  int copies = 0;
  int others = exchange.frame().empty() ? 0 : 1;  // its own, of which a copy may come as well
  while (const auto frame = assembler.Next(true)) {
    if (*frame == exchange.frame()) continue;
    ++(taken_.WasForOther(exchange.request().bytes, *frame) ? copies : others);
  }
  return copies > 0 && others < 2;
}

Finding ReplyHabits::Compare(const HeardExchange& exchange, Finding finding) {
  const Bytes& request = exchange.request().bytes;
  if (finding.symptom == Symptom::bad_check &&
      taken_.IsShorterThanLast(request, exchange.heard())) {
    finding.symptom = Symptom::bytes_lost;
    finding.cause.clear();
    return finding;
  }
  if (finding.symptom != Symptom::bytes_lost || finding.cause.empty()) return finding;
  TakenReply& misfit = of_[*exchange.member()].misfit;
  TakenReply now{request, exchange.heard()};
  if (misfit == now) finding.symptom = Symptom::other_form;
  misfit = std::move(now);
  return finding;
}

}  // namespace baudgate
