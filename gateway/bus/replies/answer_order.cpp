// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/replies/answer_order.h"

#include <utility>
#include <vector>

namespace baudgate {
namespace {

/// The latest request and those before it.
constexpr std::size_t kRemembered = AnswerOrder::kMostOwed + 1;

constexpr std::uint64_t Bit(std::size_t number) { return std::uint64_t{1} << number; }

}  // namespace

void AnswerOrder::OnSent(const SentRequest& request) {
  sent_[++count_ % sent_.size()] = request;
  answered_ = (answered_ << 1U) | (answered_ & Bit(kMostOwed));  // that one, or an older one
}

void AnswerOrder::OnStranger(Instant now) {
  for (std::size_t lag = 0; lag < Owed(); ++lag) {
    if (SentBefore(lag).place == SentRequest::kStranger) return;
  }
  for (std::size_t i = 0; i < kMostOfStrangers; ++i) {
    OnSent({SentRequest::kStranger, {}, now, false});
    answered_ |= 1;
  }
}

/// Removes requests of strangers ("?"). The mark shows which request may have been answered last:
///
///   sent        a ? ? b      a ? ? b      a ? ? b
///   marked        ^ ^        ^ ^ ^              ^
///   then        a b          a b          a b
///   marked      ^            ^              ^
void AnswerOrder::ForgetStrangers() {
  std::vector<SentRequest> ours;  // the latest first
  std::uint64_t answered = 0;
  for (std::size_t lag = 0; lag <= kMostOwed; ++lag) {
    if ((answered_ & Bit(lag)) != 0) answered |= Bit(ours.size());
    if (SentBefore(lag).place != SentRequest::kStranger) ours.push_back(SentBefore(lag));
  }
  for (std::size_t lag = 0; lag < ours.size(); ++lag) {
    sent_[(count_ - lag) % sent_.size()] = std::move(ours[lag]);
  }
  answered_ = answered;
}

/// Which of the requests may be answered so: the one `nearest` before the latest, and on until
/// before `end`. What strangers sent is so only while it is owed: any reply could be one to them.
std::uint64_t AnswerOrder::Fitting(std::size_t nearest, std::size_t end,
                                   const MayAnswer& may_answer) const {
  std::uint64_t fitting = 0;
  for (std::size_t lag = nearest; lag < end; ++lag) {
    const SentRequest& sent = SentBefore(lag);
    const bool strange = sent.place == SentRequest::kStranger;
    if (strange ? lag < Owed() : may_answer(sent, lag)) fitting |= Bit(lag);
  }
  return fitting;
}

bool AnswerOrder::OnAnswer(bool fits, const MayAnswer& may_answer) {
  // Behind the one that was answered before.
  const std::uint64_t fitting = (fits ? 1 : 0) | Fitting(1, Owed(), may_answer);
  if (fitting != 0) answered_ = fitting;
  return fitting != 0;
}

/// What other masters were owed has come by now, or is counted still.
void AnswerOrder::OnLost() {
  for (std::size_t lag = Owed(); lag <= kMostOwed; ++lag) {
    SentRequest& sent = sent_[(count_ - lag) % sent_.size()];
    if (sent.place == SentRequest::kStranger) sent.place = SentRequest::kNobody;
  }
  answered_ = ~std::uint64_t{1};
}

bool AnswerOrder::IsBehindProof() const {
  std::size_t before = 1;
  while (before < kMostOwed && IsSame(before)) ++before;
  const SentRequest& sent = SentBefore(before);
  return sent.proof && Owed() <= before;
}

bool AnswerOrder::MayBeEarlier(const MayAnswer& may_answer) const {
  return Fitting(1, kRemembered, may_answer) != 0;
}

void AnswerOrder::OnCopy() {
  if (Owed() < kMostOwed) answered_ |= answered_ << 1U;
}

bool AnswerOrder::Owes(const std::function<bool(const SentRequest&)>& is_one) const {
  for (std::size_t lag = 0; lag < Owed(); ++lag) {
    if (is_one(SentBefore(lag))) return true;
  }
  return false;
}

bool AnswerOrder::IsSafe() const {
  return !Owes([](const SentRequest& sent) { return !sent.proof; });
}

bool AnswerOrder::IsAnswerTo(const Bytes& request) const {
  for (std::size_t lag = 0; lag <= Owed(); ++lag) {
    if ((answered_ & Bit(lag)) == 0) continue;
    const bool same = SentBefore(lag).context == SentBefore(0).context;
    if (!same || SentBefore(lag).bytes != request) return false;
  }
  return true;
}

bool AnswerOrder::IsOfLatest() const {
  for (std::size_t lag = 1; lag <= Owed(); ++lag) {
    if (!IsSame(lag)) return false;
  }
  return true;
}

}  // namespace baudgate
