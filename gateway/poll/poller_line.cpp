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
  while (const auto earlier = examiner_.TakeEarlier()) {
    ledger_.devices.OnMore(*earlier->member, earlier->finding, earlier->back);
    // It is not waited for any longer: its neighbours would pay for that.
    if (earlier->lateness > Duration::zero()) {
      upkeep_.OnLate(*earlier->member, earlier->lateness, now_.instant);
    }
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
  unasked_.OnInput(news.unasked, now_);
  if (news.send) Send();
  if (news.stray_before.count > 0) OnStray(news.stray_before);
  if (news.end && run_.job() != nullptr) run_.OnEnd(std::move(*news.end));
  if (news.stray.count > 0) OnStray(news.stray);
  if (!news.second_reply || owed_.late.last() == nullptr) return;
  ledger_.devices.OnSecondReply(*owed_.late.last());
  owed_.whose.OnSecondReply(*owed_.late.last());
  upkeep_.DoubtLatest(now_.instant);
}

void Poller::OnStray(const StrayBytes& stray) {
  const LateAnswers::Stray told = owed_.late.OnStray(stray, now_.instant);
  if (told.counts) ledger_.line.OnStray(stray.count);
  if (told.late != nullptr) upkeep_.OnLate(*told.late, told.lateness, now_.instant);
  if (told.warned != nullptr) listener_.OnWarning(told.warned->index, told.warning);
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
