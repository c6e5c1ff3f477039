// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/answer_order.h"

namespace baudgate {
namespace {

constexpr std::uint64_t Bit(std::size_t number) { return std::uint64_t{1} << number; }

}  // namespace

void AnswerOrder::OnSent(const SentRequest& request) {
  sent_[++count_ % sent_.size()] = request;
  answered_ = (answered_ << 1U) | (answered_ & Bit(kMostOwed));  // that one, or an older one
}

bool AnswerOrder::OnAnswer(bool fits, const MayAnswer& may_answer) {
  if (fits && Owed() == 1) {
    answered_ = 1;
    return true;
  }
  std::uint64_t fitting = fits ? 1 : 0;
  for (std::size_t lag = 1; lag <= kMostOwed; ++lag) {
    if (may_answer(SentBefore(lag))) fitting |= Bit(lag);
  }
  // Behind the one that was answered before; where that can not be, any.
  const std::uint64_t owed = fitting & (Bit(Owed()) - 1);
  if (fitting != 0) answered_ = owed != 0 ? owed : fitting;
  return fitting != 0;
}

bool AnswerOrder::MayBeEarlier(const MayAnswer& may_answer) const {
  for (std::size_t lag = 1; lag <= kMostOwed; ++lag) {
    if (may_answer(SentBefore(lag))) return true;
  }
  return false;
}

void AnswerOrder::OnCopy() {
  if (Owed() < kMostOwed) answered_ |= answered_ << 1U;
}

bool AnswerOrder::IsSafe() const {
  for (std::size_t lag = 0; lag < Owed(); ++lag) {
    if (!SentBefore(lag).proof) return false;
  }
  return true;
}

bool AnswerOrder::IsAnswerTo(const Bytes& request) const {
  for (std::size_t lag = 0; lag <= Owed(); ++lag) {
    if ((answered_ & Bit(lag)) != 0 && SentBefore(lag).bytes != request) return false;
  }
  return true;
}

bool AnswerOrder::IsOfLatest() const {
  for (std::size_t lag = 1; lag <= Owed(); ++lag) {
    if (SentBefore(lag).bytes != SentBefore(0).bytes) return false;
  }
  return true;
}

}  // namespace baudgate
