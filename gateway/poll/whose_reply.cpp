// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/whose_reply.h"

#include <algorithm>
#include <utility>

namespace baudgate {
namespace {

bool IsProof(const Request& request) { return request.steady || request.distinct; }

/// "No", "not now": the device is there, but any request may be answered so.
bool IsRefusal(Outcome outcome) { return ProvesLife(outcome) && outcome != Outcome::ok; }

}  // namespace

WhoseReply::State& WhoseReply::Of(const Member& member) const {
  if (states_.size() <= member.place) states_.resize(member.place + 1);
  return states_[member.place];
}

AnswerOrder& WhoseReply::OrderOf(const Member& member) const {
  State& own = Of(member);
  return own.first == kSelf ? own.order : states_[own.first].order;
}

void WhoseReply::Recognise(Member& member, const Bytes& sender) {
  if (!member.sender.empty() || sender.empty()) return;
  member.sender = sender;
  for (const Member* other : roster_.everyone()) {
    if (other == &member || !member.IsSame(*other)) continue;
    const std::size_t first = Of(*other).first;
    Of(member).first = first == kSelf ? other->place : first;
    return;
  }
}

/// A reply that carries its sender's address is none of those that a serial server owes to others.
bool WhoseReply::MayBeInStep(const Asked& asked) const {
  return OrderOf(*asked.member).MayBeInStep() && (asked.named() || line_.MayBeInStep());
}

bool WhoseReply::IsSafe(const Asked& asked) const {
  if (IsProof(*asked.request)) return true;
  return OrderOf(*asked.member).IsSafe() && (asked.named() || line_.IsSafe());
}

bool WhoseReply::NeedsProbeFirst(const Asked& asked, Instant now) const {
  const Member& member = *asked.member;
  const bool answered = asked.request->expect.reply == Expectation::Reply::one;
  if (!asked.first || !answered || !member.in_use || !roster_.IsDevice(member)) return false;
  const State& state = Of(member);
  const Duration holds = asked.renews ? kProofRenews : kProofHolds;
  if (!state.answered_probe || now - state.proven_at > holds) return true;
  if (IsSafe(asked) || IsUnprovable(member)) return false;
  // Who lags no more than he is known to answers the same request often enough in a row, if that is
  // not too often. More would not end: a round of 22 requests looks as if he lagged by 22.
  return Owed(asked) > std::min(state.behind, kMostTriesMore);
}

bool WhoseReply::IsOwedAlone(const Asked& asked) const {
  if (roster_.IsDevice(*asked.member)) return Owed(asked) == 1;
  return !lost_.MayCome(*asked.member, asked.began);
}

void WhoseReply::OnTrusted(const Member& member) {
  OrderOf(member).Reset();
  line_.Reset();
}

void WhoseReply::OnSent(const Asked& asked, Instant now) {
  if (asked.request->expect.reply == Expectation::Reply::none) return;  // nothing is owed to it
  const SentRequest sent{asked.member->place, asked.request->bytes, now, IsProof(*asked.request)};
  OrderOf(*asked.member).OnSent(sent);
  line_.OnSent(sent);
}

/// The conversation has taken the reply for one to this request. An identification has to be the
/// one that is known.
bool WhoseReply::Fits(const Asked& asked, View frame, Outcome outcome) const {
  if (!ProvesLife(outcome)) return false;
  const Identity& identity = Of(*asked.member).identity;
  return !identity.IsAskedBy(asked.request->bytes) || identity.Is(frame) ||
         (identity.names() && IsRefusal(outcome));
}

/// Example: "<1D:SPAJ 140C:5E" answers ">1RF:CC", if that is what relay 1 is, and no other request.
/// Two Modbus registers answer every read of two registers.
bool WhoseReply::MayAnswer(const SentRequest& sent, View frame, Outcome outcome) const {
  if (sent.place == SentRequest::kNobody) return false;
  const Member& asked = *roster_.everyone()[sent.place];
  const Identity& identity = Of(asked).identity;
  if (identity.IsAskedBy(sent.bytes)) {
    return identity.Is(frame) || (identity.names() && IsRefusal(outcome));
  }
  if (identity.names() && identity.Is(frame)) return false;
  // Of what routes ask nobody here knows the form.
  const Device* const device = roster_.AsDevice(asked);
  return device == nullptr || ProvesLife(device->conversation->Check(sent.bytes, frame));
}

WhoseReply::Verdict WhoseReply::OnReply(const Asked& asked, View frame, Outcome outcome) {
  const Request& request = *asked.request;
  const auto may_answer = [&](const SentRequest& sent) { return MayAnswer(sent, frame, outcome); };
  const bool proof = IsProof(request);
  State& state = Of(*asked.member);
  AnswerOrder& order = OrderOf(*asked.member);
  Verdict verdict;
  if (asked.probe && ProvesLife(outcome)) state.proofless = proof ? 0 : state.proofless + 1;
  if (request.steady && ProvesLife(outcome) && !Fits(asked, frame, outcome)) {
    // Nothing that was asked is answered so: somebody else identifies himself.
    verdict.replaced = !order.MayBeEarlier(may_answer);
    if (verdict.replaced) state.identity.Learn(request.bytes, frame, outcome);
  } else if (state.identity.known() && state.proofless >= kProbesWithoutProof) {
    verdict.replaced = true;
    state.identity = {};
  }
  const bool fits = Fits(asked, frame, outcome);
  verdict.shifted = !fits && order.Owed() == 1 && (asked.named() || line_.Owed() == 1);
  if (asked.probe && ProvesLife(outcome) && !proof) order.ForgetStrangers();  // who could tell?
  const bool own = order.OnAnswer(fits, may_answer);
  const bool known = line_.OnAnswer(fits, may_answer);
  if (!known) line_.OnForgotten();
  if (!own && !known) order.OnForgotten();
  const bool names = request.steady && ProvesLife(outcome) && outcome != Outcome::busy;
  if (names && !state.identity.known() && order.IsAnswerTo(request.bytes)) {
    state.identity.Learn(request.bytes, frame, outcome);
  }
  // ? ? ? P P P P: of four replies three at most were to strangers, so the last was to a P. One
  // that is owed to another P could be told.
  if (state.strangers && proof && outcome == Outcome::ok && order.IsOfLatest()) {
    order.Reset();
    state.strangers = false;
  }
  verdict.elsewhere = !MayBeInStep(asked);
  verdict.proven =
      order.IsAnswerTo(request.bytes) && (asked.named() || line_.IsAnswerTo(request.bytes));
  if (verdict.proven) state.behind = proof ? Owed(asked) : std::min(state.behind, Owed(asked));
  if (!asked.probe && fits && order.IsInStep()) state.read = true;
  // Who has a name is read when he has told it.
  if (asked.probe && !proof && state.identity.known()) verdict.proven = false;
  verdict.older = asked.named() ? order.Older() : std::max(order.Older(), line_.Older());
  return verdict;
}

void WhoseReply::OnEnd(const Asked& asked, Outcome outcome, bool silent, Instant now) {
  // After damage, and after others' replies, an answer may still come.
  State& state = Of(*asked.member);
  if (!ProvesLife(outcome) && outcome != Outcome::unexpected && !roster_.IsDevice(*asked.member)) {
    lost_.OnLost(*asked.member, asked.request->bytes, now);
  }
  if (silent && outcome == Outcome::no_reply) state.answered_probe = false;  // another may come now
  if (!asked.probe || !ProvesLife(outcome)) return;
  state.proven_at = now;
  state.answered_probe = IsProof(*asked.request) || !state.identity.known();
}

void WhoseReply::OnOpened(const Member& member, Instant now) {
  OrderOf(member).OnStranger(now);
  Of(member).strangers = true;
}

void WhoseReply::OnReconnect(const Member& member) {
  Of(member).answered_probe = false;
  Of(member).proofless = 0;
  Of(member).behind = 0;
  Of(member).read = false;
}

void WhoseReply::OnStored(QueryRef query) {
  if (std::ranges::find(unproven_, query) != unproven_.end()) return;
  unproven_.push_back(query);
}

void WhoseReply::OnSecondReply(const Member& member) {
  OrderOf(member).OnCopy();
  line_.OnCopy();
}

}  // namespace baudgate
