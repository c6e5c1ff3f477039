// Between the line and the job under way: what the line has to say, and what it is given to send.
// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/poll/poller.h"
#include "gateway/poll/samples.h"

namespace baudgate {

void Poller::Pump() {
  while (line_.idle()) {
    if (run_.job() == nullptr) {
      if (winding_up_ || paused_) return;
      std::unique_ptr<Job> job = chooser_.Next(idle());
      if (!job) return;
      run_.Begin(std::move(job));
      continue;
    }
    switch (run_.TakeTurn()) {
      case JobRun::Turn::send:
        Hear(line_.Start(run_.Start(idle_since_), now_.instant));
        break;
      case JobRun::Turn::next:
        break;
      case JobRun::Turn::wait:
        return;
    }
  }
}

void Poller::Send() {
  if (const auto more = examiner_.More()) ledger_.OnMore(*examiner_.member(), *more);
  while (const auto late = examiner_.TakeLate()) {
    ledger_.OnMore(*late->member, late->finding, late->back);
  }
  const Request& request = run_.Send();
  examiner_.Begin(*run_.job()->member, request, run_.job()->member->times, now_.instant);
  echo_.OnSent(request.bytes);
  port_.Send(request.bytes, run_.job()->member->serial, now_);
}

Outcome Poller::Judge(View frame, Instant now) {
  examiner_.Take(frame);
  return run_.Judge(frame, echo_.MayBeEcho(run_.job()->request, frame), now);
}

/// What an input has led to, in its order; what follows from an exchange's end is for Settle.
void Poller::Hear(LineNews news) {
  OnUnasked(news.unasked);
  if (news.send) Send();
  if (news.stray_before.count > 0) OnStray(news.stray_before);
  if (news.end && run_.job() != nullptr) run_.OnEnd(std::move(*news.end));
  if (news.stray.count > 0) OnStray(news.stray);
  if (!news.second_reply || late_.last() == nullptr) return;
  ledger_.OnSecondReply(*late_.last());
  whose_reply_.OnSecondReply(*late_.last());
  upkeep_.DoubtLatest(now_.instant);
}

void Poller::OnUnasked(const Heard& heard) {
  if (!speaker_.in_use()) return;
  Device& device = *speaker_.device();
  for (std::size_t i = 0; i < heard.damaged; ++i) {
    upkeep_.OnUnasked(device, Outcome::corrupt, std::string(heard.why), speaker_.OnDamaged(),
                      now_.instant);
  }
  for (const UnaskedMessage& message : heard.messages) {
    Speaker::Said said = speaker_.OnMessage(message, now_);
    upkeep_.OnUnasked(device, said.outcome, said.reason, speaker_.Look(said), now_.instant);
    TakeUnasked(std::move(said));
  }
}

void Poller::TakeUnasked(Speaker::Said said) {
  Device& device = *speaker_.device();
  upkeep_.OnHeard(device, now_.instant);
  if (!said.samples.empty()) {
    store_.Update(device.index, said.samples, said.received, {});
    listener_.OnRead(device.index, PointsOf(said.samples), said.received);
  }
  if (said.lost > 0) ledger_.OnLostEvents(device, said.lost);
  if (!said.warning.empty()) listener_.OnWarning(device.index, said.warning);
  if (said.events) listener_.OnEvents(std::move(*said.events));
}

void Poller::OnStray(const StrayBytes& stray) {
  const LateAnswers::Stray told = late_.OnStray(stray, now_.instant);
  if (told.counts) ledger_.OnStray(stray.count);
  if (told.late != nullptr) {
    ledger_.OnLate(*told.late, told.lateness);
    ledger_.OnPatience(*told.late, late_.PatienceFor(*told.late));
    upkeep_.ShowLine(now_.instant);
  }
  if (told.warned != nullptr) listener_.OnWarning(told.warned->index, told.warning);
}

void Poller::Conclude() {
  std::optional<ExchangeEnd> end = run_.TakeEnd();
  if (!end) return;
  const Job& job = *run_.job();
  if (echo_.OnExchangeEnd(job.request, *end)) ledger_.OnCollision();
  ledger_.OnRing(*job.member, echo_.is_cut());
  const bool good = ProvesLife(end->outcome) || end->outcome == Outcome::line_down;
  if (!good) port_.DropUnsent();
  Finding finding = examiner_.End(end->outcome);
  run_.Conclude(std::move(*end), std::move(finding));
}

}  // namespace baudgate
