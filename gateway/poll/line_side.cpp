// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/line_side.h"

#include <utility>

namespace baudgate {

LineSide::LineSide(Reception reception, JobRun& run, UnaskedSide& unasked, Upkeep& upkeep,
                   Ledger& ledger, RequestPort& port)
    : reception_(std::move(reception)),
      run_(run),
      unasked_(unasked),
      upkeep_(upkeep),
      ledger_(ledger),
      port_(port) {
  if (const Standing* const standing = unasked_.speaker().standing()) line_.Listen(*standing);
}

// ---------------------------------------------------------------- inputs

void LineSide::OnOpened(Now now, bool keeps_bit_rate) {
  reception_.OnOpened();
  unasked_.OnOpened();
  line_.OnOpened(now.instant, keeps_bit_rate);
}

void LineSide::OnClosed(const std::string& reason, Now now) {
  LineNews news = line_.OnClosed();
  if (news.end) news.end->reason = reason;
  Hear(std::move(news), now);
  Conclude();
  reception_.OnClosed();
  run_.OnClosed(reason);
}

void LineSide::OnBytes(View bytes, Now now) {
  const Job* const job = run_.job();
  const EchoWatch::Received heard = reception_.OnBytes(bytes, job, now.instant);
  if (heard.echo) ledger_.line.OnEcho();
  if (heard.warning != nullptr) ledger_.line.Warn(*job->member, heard.warning);
  if (heard.collision) {
    ledger_.line.OnCollision();
    ledger_.line.OnSecondMaster();
    Hear(line_.OnCollision(now.instant), now);
  }
  if (heard.bytes.empty()) return;
  ledger_.line.OnReceived(heard.bytes);
  unasked_.OnBytes(heard.bytes, now.instant);
  Hear(line_.OnBytes(heard.bytes, now.instant), now);
}

void LineSide::OnEnded(Now now) { Hear(line_.OnEnded(now.instant), now); }

void LineSide::OnTimer(Now now) {
  Withdraw();  // the program may have been stopped since the line began to wait for its quiet
  Hear(line_.OnTimer(now.instant), now);
}

// ---------------------------------------------------------------- the request of the job

void LineSide::Start(Instant idle_since, Now now) {
  Hear(line_.Start(run_.Start(idle_since), now.instant), now);
}

void LineSide::Withdraw() {
  if (waits_for_quiet() && run_.Withdraw()) line_.Cancel();
}

void LineSide::Send(Now now) {
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

// ---------------------------------------------------------------- what the line reports

Outcome LineSide::Judge(View frame, Instant now) {
  return reception_.Judge(*run_.job(), frame, now);
}

/// Applies the news of one input, in their order. Conclude applies the end of an exchange.
void LineSide::Hear(LineNews news, Now now) {
  unasked_.OnInput(news.unasked, now);
  if (news.send) Send(now);
  if (news.stray_before.count > 0) OnStray(news.stray_before, now.instant);
  if (news.end && run_.job() != nullptr) run_.OnEnd(std::move(*news.end));
  if (news.stray.count > 0) OnStray(news.stray, now.instant);
  if (news.second_reply) upkeep_.OnSecondReply(now.instant);
}

void LineSide::OnStray(const StrayBytes& stray, Instant now) {
  const LateAnswers::Stray told = upkeep_.OnStray(stray, now);
  if (told.warned != nullptr) ledger_.line.Warn(*told.warned, told.warning);
}

void LineSide::Conclude() {
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
