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
      if (hold_.holds()) return;
      std::unique_ptr<Job> job = chooser_.Next(time_.idle());
      if (!job) return;
      run_.Begin(std::move(job));
      continue;
    }
    switch (run_.TakeTurn()) {
      case JobRun::Turn::send:
        Hear(line_.Start(run_.Start(time_.idle().since), time_.now().instant));
        break;
      case JobRun::Turn::next:
        break;
      case JobRun::Turn::wait:
        return;
    }
  }
}

void Poller::Send() {
  const Now now = time_.now();
  for (const Examiner::Earlier& changed : reception_.TakeChanged()) {
    ledger_.devices.OnMore(*changed.member, changed.finding, changed.back);
    // The line's patience with this device does not grow: its neighbours would pay for it.
    if (changed.lateness > Duration::zero()) {
      upkeep_.CountLate(*changed.member, changed.lateness, now.instant);
    }
  }
  const Request& request = run_.Send();
  reception_.OnSend(*run_.job(), now.instant);
  port_.Send(request.bytes, run_.job()->member->serial, now);
}

Outcome Poller::Judge(View frame, Instant now) { return reception_.Judge(*run_.job(), frame, now); }

/// What an input has led to, in its order; what follows from an exchange's end is for Settle.
void Poller::Hear(LineNews news) {
  unasked_.OnInput(news.unasked, time_.now());
  if (news.send) Send();
  if (news.stray_before.count > 0) OnStray(news.stray_before);
  if (news.end && run_.job() != nullptr) run_.OnEnd(std::move(*news.end));
  if (news.stray.count > 0) OnStray(news.stray);
  if (!news.second_reply || owed_.late.last() == nullptr) return;
  ledger_.devices.OnSecondReply(*owed_.late.last());
  owed_.whose.OnSecondReply(*owed_.late.last());
  upkeep_.DoubtLatest(time_.now().instant);
}

void Poller::OnStray(const StrayBytes& stray) {
  const Instant now = time_.now().instant;
  const LateAnswers::Stray told = owed_.late.OnStray(stray, now);
  if (told.counts) ledger_.line.OnStray(stray.count);
  if (told.late != nullptr) upkeep_.CountLate(*told.late, told.lateness, now);
  if (told.warned != nullptr) listener_.OnWarning(told.warned->index, told.warning);
}

void Poller::Conclude() {
  std::optional<ExchangeEnd> end = run_.TakeEnd();
  if (!end) return;
  const Job& job = *run_.job();
  const Reception::Seen seen = reception_.OnEnd(job, *end);
  if (seen.no_echo) ledger_.line.OnCollision();
  ledger_.line.OnRing(*job.member, seen.cut);
  if (seen.negotiates) ledger_.line.OnNegotiation();
  if (!ProvesLife(end->outcome)) {
    const bool closed = end->outcome == Outcome::line_down;
    if (port_.IsUnsent()) {
      run_.NeverLeft();
      if (!closed) end->reason = kNotConnected;
    }
    if (!closed) port_.DropUnsent();
  }
  run_.Conclude(std::move(*end), seen.finding);
}

}  // namespace baudgate
