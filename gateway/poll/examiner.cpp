// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/examiner.h"

#include <algorithm>
#include <string>

#include "gateway/line/assembler.h"

namespace baudgate {
namespace {

/// More is not looked at. The longest reply of a Modbus device has 260 bytes.
constexpr std::size_t kKept = 1024;
constexpr std::size_t kArrivals = 256;

}  // namespace

void Examiner::Begin(const Member& member, const Request& request, const LineTimes& times,
                     Instant now) {
  member_ = &member;
  request_ = request;
  times_ = times;
  sent_ = now + static_cast<std::int64_t>(request.bytes.size()) * times.character;
  if (open_.size() <= member.place) open_.resize(member.place + 1);
  Asked& asked = open_[member.place];
  if (asked.last.member != nullptr && asked.last.request.bytes != request.bytes) {
    asked.before = std::move(asked.last);
  }
  asked.last = {&member, request, sent_};
  outcome_ = Outcome::none;
  frame_ = 0;
  judged_ = 0;
  heard_.clear();
  arrivals_.clear();
}

void Examiner::Hear(View bytes, Instant now) {
  if (member_ == nullptr || heard_.size() >= kKept) return;
  if (arrivals_.size() < kArrivals) arrivals_.push_back({heard_.size(), now - sent_});
  Append(heard_, bytes.first(std::min(bytes.size(), kKept - heard_.size())));
}

Finding Examiner::End(Outcome outcome) {
  outcome_ = outcome;
  if (ProvesLife(outcome) && member_ != nullptr) open_[member_->place] = {};
  judged_ = heard_.size();
  Finding finding;
  const bool plain = ProvesLife(outcome) && heard_.size() == frame_;
  if (member_ != nullptr && !plain) finding = Look();
  told_ = finding.symptom;
  return finding;
}

std::optional<Finding> Examiner::More() {
  if (member_ == nullptr || outcome_ == Outcome::none || heard_.size() == judged_)
    return std::nullopt;
  judged_ = heard_.size();
  Finding finding = Look();
  if (finding.symptom == told_) return std::nullopt;
  told_ = finding.symptom;
  return finding;
}

bool Examiner::Answers(const Open& open) const {
  if (open.member == nullptr) return false;
  const Expectation& expect = open.request.expect;
  const bool own = open.member->IsSame(*member_);
  // What may answer the present request says nothing of an earlier one.
  const bool fits = std::ranges::any_of(request_.expect.shapes, [this](const Shape& shape) {
    return heard_.size() >= shape.min_length && heard_.size() <= shape.max_length;
  });
  if (own ? fits : expect.address.empty()) return false;
  Assembler assembler;
  assembler.Begin(open.member->protocol->reply_rule, expect);
  assembler.Feed(heard_);
  return assembler.Next(true).has_value();
}

/// To an earlier request, which has remained without an answer.
const Examiner::Open* Examiner::WhoseLateReply() const {
  for (const Asked& asked : open_) {
    for (const Open* open : {&asked.last, &asked.before}) {
      if (Answers(*open)) return open;
    }
  }
  return nullptr;
}

Finding Examiner::Look() {
  static const config::Options
      kNoOptions;  // slaves that only routes reach speak Modbus, which has none
  const Device* const device = roster_.AsDevice(*member_);
  Finding finding = Examine({.protocol = member_->protocol,
                             .options = device == nullptr ? &kNoOptions : &device->config->options,
                             .request = request_.bytes,
                             .expect = &request_.expect,
                             .outcome = outcome_,
                             .heard = heard_,
                             .arrivals = arrivals_,
                             .reply = std::max(times_.reply, request_.reply),
                             .gap = times_.gap});
  constexpr Symptom kForeign[] = {Symptom::other_device, Symptom::other_reply, Symptom::odd,
                                  Symptom::noise_before, Symptom::noise_behind};
  if (std::ranges::find(kForeign, finding.symptom) == std::end(kForeign)) return finding;
  const Open* const whose = WhoseLateReply();
  if (whose == nullptr || arrivals_.empty()) return finding;
  const Finding late = {.symptom = Symptom::late,
                        .time = sent_ + arrivals_.back().after - whose->sent};
  if (whose->member->IsSame(*member_)) return IsAnswered(finding.symptom) ? Finding{} : late;
  late_ = {whose->member, late};
  if (IsAnswered(finding.symptom)) return {};
  const Device* const other = roster_.AsDevice(*whose->member);
  finding = {.symptom = Symptom::late_other,
             .cause = other == nullptr ? "slave " + std::to_string(whose->member->slave)
                                       : other->config->name};
  return finding;
}

}  // namespace baudgate
