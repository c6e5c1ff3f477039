// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/whose_reply.h"

#include <algorithm>
#include <functional>
#include <string_view>
#include <utility>

namespace baudgate {
namespace {

/// A second reply shows itself behind the exchange that it spoilt, or a few later.
constexpr std::size_t kMostUnproven = 8;

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
  return OrderOf(*asked.member).MayBeInStep() && (asked.named() || order_.MayBeInStep());
}

bool WhoseReply::IsSafe(const Asked& asked) const {
  const AnswerOrder::Fingerprint fingerprint = FingerprintOf(asked);
  return OrderOf(*asked.member).IsSafe(fingerprint) &&
         (asked.named() || order_.IsSafe(fingerprint));
}

AnswerOrder::Fingerprint WhoseReply::ProbeOf(const Member& member) const {
  const State& state = Of(member);
  if (!state.identity.known()) return AnswerOrder::kNamelessProbe;
  const std::size_t first = state.first == kSelf ? member.place : state.first;
  return AnswerOrder::Probe(first);
}

AnswerOrder::Fingerprint WhoseReply::FingerprintOf(const Asked& asked) const {
  const Identity& identity = Of(*asked.member).identity;
  const bool probe = identity.known() ? identity.IsAskedBy(*asked.request) : asked.probe;
  if (probe) return ProbeOf(*asked.member);
  return std::hash<std::string_view>{}(AsText(asked.request->bytes)) << 1U;
}

bool WhoseReply::NeedsProbeFirst(const Asked& asked) const {
  return !Of(*asked.member).answered_probe || !MayBeInStep(asked) || !IsSafe(asked);
}

void WhoseReply::OnSent(const Asked& asked) {
  heard_ = false;
  safe_ = IsSafe(asked);
  Of(*asked.member).identity.OnSent(*asked.request);
  sent_ = FingerprintOf(asked);
  OrderOf(*asked.member).OnSent(sent_);
  order_.OnSent(sent_);
}

/// An identification is the same frame every time and no answer to anything else. Where the
/// protocol has none, the form of an answer tells a probe from other requests.
bool WhoseReply::LooksLikeProbe(const Asked& asked, View frame, Outcome outcome) {
  Identity& identity = Of(*asked.member).identity;
  const bool certain = IsInStep(*asked.member) && order_.IsInStep();
  if (!identity.known() && certain && asked.request->steady && outcome == Outcome::ok) {
    identity.Learn(*asked.request, frame);
  }
  // What may be replies to earlier requests says nothing about who answers.
  if (asked.probe && ProvesLife(outcome) && MayBeInStep(asked)) {
    identity.OnProbeAnswered(*asked.request);
  }
  if (identity.known()) return identity.Matches(*asked.request, frame, outcome);
  return asked.probe == ProvesLife(outcome);
}

WhoseReply::Verdict WhoseReply::OnReply(const Asked& asked, View frame, Outcome outcome) {
  heard_ = true;
  // The first answer to a probe tells the name that makes it the device's own.
  const auto probe = AnswerOrder::IsProbe(sent_) ? sent_ : ProbeOf(*asked.member);
  const bool looks_like_probe = LooksLikeProbe(asked, frame, outcome);
  OrderOf(*asked.member).OnAnswer(probe, looks_like_probe);
  order_.OnAnswer(probe, looks_like_probe);
  // A device that does not tell its name is probed with a read: that proves life, not the value.
  return {.elsewhere = !MayBeInStep(asked), .proves_life_only = !safe_ && asked.probe};
}

void WhoseReply::OnEnd(const Asked& asked, Outcome outcome, bool silent) {
  const Member& member = *asked.member;
  // After damage, and after others' replies, an answer may still come.
  if (!heard_ && silent) {
    OrderOf(member).OnSilence();
    // A device that is offline was asked for its identification only. A late reply to that is
    // recognised, so the order of the whole line is not in doubt.
    const bool identified = Of(member).identity.known() && sent_ == ProbeOf(member);
    if (!(identified && member.health.offline() && order_.IsInStep())) order_.OnSilence();
  }
  if (asked.probe && ProvesLife(outcome)) Of(member).answered_probe = true;
}

void WhoseReply::OnClosed(const Member& member) {
  OrderOf(member).OnSilence();
  order_.OnSilence();
}

void WhoseReply::OnStored(QueryRef query) {
  if (std::ranges::find(unproven_, query) != unproven_.end()) return;
  if (unproven_.size() == kMostUnproven) unproven_.erase(unproven_.begin());
  unproven_.push_back(query);
}

std::vector<QueryRef> WhoseReply::OnSecondReply(const Member& member) {
  OrderOf(member).OnSilence();
  order_.OnSilence();
  return std::exchange(unproven_, {});
}

}  // namespace baudgate
