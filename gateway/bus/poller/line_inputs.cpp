// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/line_inputs.h"

#include <algorithm>
#include <utility>

#include "gateway/base/deadline.h"

namespace baudgate {

void LineInputs::OnTime(Now now) {
  arrival_.OnInput(now.instant, IsAwaiting());
  ledger_.OnTime(now, !line_.idle(), line_.member(), !line_.asks());
}

std::optional<Instant> LineInputs::Deadline() const {
  return Soonest(
      {line_.Deadline(), IsAwaiting() ? std::optional(arrival_.NextLook()) : std::nullopt});
}

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

/// A reply and a message are as old as they may be. No reply is older than its request.
void LineInputs::Date(LineNews& news, Instant now) const {
  for (UnaskedMessage& message : news.unasked.messages) {
    message.since = now - arrival_.Earliest(now - message.since);
  }
  if (!news.end) return;
  const Instant read = now - news.end->since_reply;
  news.end->since_reply = now - std::max(arrival_.Earliest(read), read - news.end->round_trip);
}

/// The news of one input, in their order. Conclude applies the end of an exchange.
void LineInputs::Apply(LineNews news, Now now) {
  Date(news, now.instant);
  unasked_.OnInput(news.unasked, now);
  if (news.send) Send(now);
  if (news.stray_before.count > 0) OnStray(news.stray_before, now.instant);
  if (news.end) line_.OnEnd(std::move(*news.end));
  if (news.stray.count > 0) OnStray(news.stray, now.instant);
  if (news.second_reply) upkeep_.OnSecondReply(now.instant);
}

void LineInputs::Send(Now now) {
  for (const EarlierFinding& changed : line_.TakeChanged()) {
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
