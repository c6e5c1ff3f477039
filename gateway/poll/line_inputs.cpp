// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/line_inputs.h"

#include <utility>

namespace baudgate {

void LineInputs::OnClosed(const std::string& reason, Now now) {
  LineNews news = line_.OnClosed();
  if (news.end) news.end->reason = reason;
  Apply(std::move(news), now);
  Conclude();
  line_.OnPortClosed(reason);
}

void LineInputs::OnBytes(View bytes, Now now) {
  LineSide::Received received = line_.OnBytes(bytes, now.instant);
  const EchoWatch::Received& heard = received.heard;
  ledger_.line.OnHeard(heard, received.member);
  Apply(std::move(received.collided), now);
  if (heard.bytes.empty()) return;
  unasked_.OnBytes(heard.bytes, now.instant);
  Apply(std::move(received.news), now);
}

/// The news of one input, in their order. Conclude applies the end of an exchange.
void LineInputs::Apply(LineNews news, Now now) {
  unasked_.OnInput(news.unasked, now);
  if (news.send) Send(now);
  if (news.stray_before.count > 0) OnStray(news.stray_before, now.instant);
  if (news.end) line_.OnEnd(std::move(*news.end));
  if (news.stray.count > 0) OnStray(news.stray, now.instant);
  if (news.second_reply) upkeep_.OnSecondReply(now.instant);
}

void LineInputs::Send(Now now) {
  for (const Examiner::Earlier& changed : line_.TakeChanged()) {
    ledger_.devices.OnMore(*changed.member, changed.finding, changed.back);
    // The line's patience with this device does not grow: its neighbours would pay for it.
    if (changed.lateness > Duration::zero()) {
      upkeep_.CountLate(*changed.member, changed.lateness, now.instant);
    }
  }
  line_.Send(now);
}

void LineInputs::OnStray(const StrayBytes& stray, Instant now) {
  const LateAnswers::Stray told = upkeep_.OnStray(stray, now);
  if (told.warned != nullptr) ledger_.line.Warn(*told.warned, told.warning);
}

void LineInputs::Conclude() {
  std::optional<LineSide::Over> over = line_.TakeEnd();
  if (!over) return;
  if (over->seen.no_echo) ledger_.line.OnNoEcho();
  ledger_.line.OnRing(*over->member, over->seen.cut);
  if (over->seen.negotiates) ledger_.line.OnNegotiation();
  line_.Conclude(std::move(*over));
}

}  // namespace baudgate
