// Between the line and the job under way: what the line has to say, and what it is given to send.
// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/poll/poller.h"

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
        judge_.OnStart();
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
  if (const auto more = examiner_.More()) ledger_.devices.OnMore(*examiner_.member(), *more);
  while (const auto late = examiner_.TakeLate()) {
    ledger_.devices.OnMore(*late->member, late->finding, late->back);
    // It is not waited for any longer: its neighbours would pay for that.
    if (late->lateness > Duration::zero()) TellLate(*late->member, late->lateness);
  }
  const Request& request = run_.Send();
  examiner_.Begin(*run_.job()->member, request, run_.job()->member->times, now_.instant);
  echo_.OnSent(request.bytes);
  port_.Send(request.bytes, run_.job()->member->serial, now_);
}

Outcome Poller::Judge(View frame, Instant now) {
  examiner_.Take(frame);
  Job& job = *run_.job();
  return judge_.Judge(job, frame, echo_.MayBeEcho(job.request, frame), now);
}

/// What an input has led to, in its order; what follows from an exchange's end is for Settle.
void Poller::Hear(LineNews news) {
  OnUnasked(news.unasked);
  if (news.send) Send();
  if (news.stray_before.count > 0) OnStray(news.stray_before);
  if (news.end && run_.job() != nullptr) run_.OnEnd(std::move(*news.end));
  if (news.stray.count > 0) OnStray(news.stray);
  if (!news.second_reply || owed_.late.last() == nullptr) return;
  ledger_.devices.OnSecondReply(*owed_.late.last());
  owed_.whose.OnSecondReply(*owed_.late.last());
  upkeep_.DoubtLatest(now_.instant);
}

void Poller::OnUnasked(const UnaskedInput& heard) {
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
  if (said.lost > 0) ledger_.devices.OnLostEvents(device, said.lost);
  intake_.TakeUnasked(device, std::move(said));
}

void Poller::OnStray(const StrayBytes& stray) {
  const LateAnswers::Stray told = owed_.late.OnStray(stray, now_.instant);
  if (told.counts) ledger_.line.OnStray(stray.count);
  if (told.late != nullptr) TellLate(*told.late, told.lateness);
  if (told.warned != nullptr) listener_.OnWarning(told.warned->index, told.warning);
}

void Poller::TellLate(const Member& member, Duration lateness) {
  if (member.device != nullptr) member.device->heard.OnLate(now_.instant);
  ledger_.line.OnLate();
  ledger_.devices.OnLate(member, lateness);
  ledger_.devices.OnPatience(member, owed_.late.PatienceFor(member));
  upkeep_.ShowLine(now_.instant);
}

void Poller::Conclude() {
  std::optional<ExchangeEnd> end = run_.TakeEnd();
  if (!end) return;
  const Job& job = *run_.job();
  if (echo_.OnExchangeEnd(job.request, *end)) ledger_.line.OnCollision();
  ledger_.line.OnRing(*job.member, echo_.is_cut());
  const bool good = ProvesLife(end->outcome) || end->outcome == Outcome::line_down;
  if (!good) port_.DropUnsent();
  Finding finding = examiner_.End(end->outcome);
  if (examiner_.TakeNegotiation()) ledger_.line.OnNegotiation();
  judge_.OnEnd(job, *end, finding);
  run_.Conclude(std::move(*end), finding);
}

}  // namespace baudgate
