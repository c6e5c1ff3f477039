// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/counters/line_account.h"

#include <utility>

namespace baudgate::bus {

Duration LineAccount::OnTime(Now now, bool busy, bool drains) {
  const Duration took = open_ && busy ? now.instant - now_.instant : Duration::zero();
  counters_.busy += took;
  drains ? minute_.OnDrained(took) : minute_.OnExchangeTime(took);
  now_ = now;
  if (others_.EndsAt(now.instant)) listener_.OnNews({News::What::collisions, true}, now_);
  minute_.OnTime(now.instant);
  return took;
}

void LineAccount::OnOpened() {
  open_ = true;
  minute_.OnOpened(now_.instant);
  OnAnswer();
}

/// Called when a device has answered or the port was opened: the line is not silent.
void LineAccount::OnAnswer() {
  silent_from_.reset();
  counters_.babble = 0;
  counters_.babble_since = now_.instant;
}

void LineAccount::OnClosed() {
  open_ = false;
  minute_.OnClosed();
}

void LineAccount::OnSent(const Member& member, const protocols::Request& request) {
  counters_.bytes_out += request.bytes.size();
  if (tap_ != nullptr) tap_->OnSent(member.index, request, now_);
}

void LineAccount::OnHeard(const EchoWatch::Received& heard, const Member* member) {
  if (heard.echo) {
    ++counters_.echoes;
    echoes_ = true;
  }
  if (heard.warning != nullptr && member != nullptr) Warn(*member, heard.warning);
  if (heard.collision) OnCollision();
  if (heard.bytes.empty()) return;
  counters_.bytes_in += heard.bytes.size();
  if (tap_ != nullptr) tap_->OnReceived(heard.bytes, now_);
}

void LineAccount::Count(Outcome outcome) {
  ++counters_.exchanges;
  ++counters_.outcomes[static_cast<std::size_t>(outcome)];
}

void LineAccount::OnExchange(const EndedExchange& ended, Now /*now*/) {
  const ExchangeEnd& end = ended.end;
  const bool life = ended.answered();
  if (ended.no_echo) ++counters_.collisions;
  OnRing(*ended.member, ended.cut);
  minute_.CountExchange(life ? ended.use : LineUse::silence);
  Count(end.outcome);
  counters_.echoed = counters_.echoed << 1U | (std::exchange(echoes_, false) ? 1U : 0U);
  if (life && !ended.broadcast) {
    counters_.round_trips.Add(end.round_trip);
    OnAnswer();
  } else if (!life && !ended.cut_off()) {
    if (!silent_from_) silent_from_ = now_.instant;
    last_failure_ = now_.instant;
  }
  if (tap_ != nullptr) tap_->OnExchangeEnd(ended.member->index, end, now_);
}

/// The echo differed from the request, so another master has sent at the same time. A burst of
/// collisions is reported to the listener.
void LineAccount::OnCollision() {
  ++counters_.collisions;
  if (!others_.Add(now_.instant)) return;
  listener_.OnNews({.what = News::What::collisions,
                    .text = "echoes differ from what was sent: another master sends on the line"},
                   now_);
}

/// `cut`: the bus has stopped echoing requests (EchoWatch::is_cut), seen while `member` was asked.
void LineAccount::OnRing(const Member& member, bool cut) {
  if (cut == cut_since_.has_value()) return;
  cut_since_ = cut ? std::optional(now_.wall) : std::nullopt;
  listener_.OnNews({News::What::ring_open, !cut}, now_);
  listener_.OnWarning(
      member.index,
      cut ? "the line does not echo any more, so none of its devices can answer; look for a broken "
            "fibre in the ring, or a device on the ring without power"
          : "the line echoes again: its ring is closed");
}

void LineAccount::Show(std::optional<Duration> notice_bound) const {
  const LineMinute::Use use = minute_.use(now_.instant);
  store_.UpdateLine(line_, [&](LineStatus& status) {
    static_cast<LineCounters&>(status) = counters_;
    status.spent = minute_.spent();
    status.use = use.busy;
    status.minute = use.shares;
    status.notice_bound = notice_bound;
    status.cut_since = cut_since_;
  });
}

std::uint64_t LineAccount::Answers() const {
  std::uint64_t answers = 0;
  for (std::size_t i = 0; i < counters_.outcomes.size(); ++i) {
    if (ProvesLife(static_cast<Outcome>(i))) answers += counters_.outcomes[i];
  }
  return answers;
}

}  // namespace baudgate::bus
