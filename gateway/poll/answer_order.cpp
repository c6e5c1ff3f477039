// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/answer_order.h"

namespace baudgate {

void AnswerOrder::OnSent(Fingerprint request) { sent_[++count_ % sent_.size()] = request; }

void AnswerOrder::OnSilence() { possible_ |= possible_ << 1U; }

void AnswerOrder::OnAnswer(Fingerprint probe, bool looks_like_probe) {
  std::uint32_t consistent = 0;
  for (std::size_t lag = 0; lag <= kMostLag; ++lag) {
    if ((SentBefore(lag) == probe) == looks_like_probe) consistent |= 1U << lag;
  }
  possible_ &= consistent;
  // A damaged frame may have ruled out lag 0 by mistake. After a probe came back as itself, lag 0
  // is possible again; if that is wrong, the next answer shows it.
  if (looks_like_probe && SentBefore(0) == probe) possible_ |= 1U;
  // Nothing fits what was known: whatever fits this answer is possible again.
  if (possible_ == 0) possible_ = consistent != 0 ? consistent : ~1U;
}

bool AnswerOrder::IsSafe(Fingerprint request) const {
  for (std::size_t lag = 1; lag <= kMostLag; ++lag) {
    if ((possible_ & (1U << lag)) == 0) continue;
    const Fingerprint answered = SentBefore(lag - 1);
    if (!IsProbe(answered) && answered != request) return false;
  }
  return true;
}

}  // namespace baudgate
