// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/line_inputs.h"

#include <algorithm>
#include <string>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate {

void Reception::OnOpened() {
  judge_.OnOpened();
  echo_.OnOpened();
  observer_.OnOpened();
}

void Reception::OnSend(const Job& job, Instant now) {
  observer_.OnRequest(*job.member, job.step.request, now);
  echo_.OnSent(job.step.request.bytes);
}

EchoWatch::Received Reception::TakeOutEcho(View bytes, const Job* job, Instant now) {
  EchoWatch::Received heard =
      echo_.OnReceived(bytes, job != nullptr ? &job->step.request : nullptr);
  if (!heard.bytes.empty()) observer_.Hear(heard.bytes, now);
  return heard;
}

Outcome Reception::Judge(Job& job, View frame, Instant now) {
  observer_.OnReply(frame);
  return judge_.Judge(job, frame, echo_.MayBeEcho(job.step.request, frame), now);
}

Reception::Seen Reception::Assess(const Job& job, ExchangeEnd& end) {
  Seen seen;
  seen.no_echo = echo_.OnExchangeEnd(job.step.request, end);
  seen.cut = echo_.is_cut();
  seen.finding = observer_.TakeFinding(end.outcome);
  seen.negotiates = observer_.TakeNegotiation();
  judge_.CompleteFinding(job, end, echo_.echoed(), seen.finding);
  return seen;
}

LineSide::LineSide(Reception& reception, const Standing* standing, JobRun& run, RequestPort& port)
    : reception_(reception), run_(run), port_(port) {
  if (standing != nullptr) line_.Listen(*standing);
}

// ---------------------------------------------------------------- inputs

void LineSide::OnOpened(Now now, bool keeps_bit_rate) {
  reception_.OnOpened();
  line_.OnOpened(now.instant, keeps_bit_rate);
}

void LineSide::OnPortClosed(const std::string& reason) {
  reception_.OnClosed();
  run_.OnClosed(reason);
}

LineSide::Received LineSide::FeedLine(View bytes, Instant now) {
  const Job* const job = run_.job();
  Received received{.member = job != nullptr ? job->member : nullptr,
                    .heard = reception_.TakeOutEcho(bytes, job, now),
                    .collided = {},
                    .news = {}};
  if (received.heard.collision) received.collided = line_.OnCollision(now);
  if (!received.heard.bytes.empty()) received.news = line_.Feed(received.heard.bytes, now);
  return received;
}

LineNews LineSide::OnTimer(Instant now) {
  Withdraw();  // the program may have been stopped since the line began to wait for its quiet
  return line_.OnTimer(now);
}

std::optional<Instant> LineSide::Deadline() const {
  const Job* const job = run_.job();
  const bool may_be_withdrawn = waits_for_quiet() && job != nullptr;
  return Soonest({line_.Deadline(), may_be_withdrawn ? LatestStart(*job) : std::nullopt});
}

Outcome LineSide::Judge(View frame, Instant now) {
  return reception_.Judge(*run_.job(), frame, now);
}

// ---------------------------------------------------------------- the request of the job

LineNews LineSide::Start(Instant idle_since, Instant now) {
  return line_.Start(run_.Start(idle_since), now);
}

void LineSide::Send(Now now) {
  const Request& request = run_.Send();
  reception_.OnSend(*run_.job(), now.instant);
  port_.Send(request.bytes, run_.job()->member->serial, now);
}

void LineSide::Withdraw() {
  if (waits_for_quiet() && run_.Withdraw()) line_.Cancel();
}

// ---------------------------------------------------------------- the end of its exchange

void LineSide::KeepEnd(ExchangeEnd end) {
  if (run_.job() != nullptr) run_.KeepEnd(std::move(end));
}

std::optional<LineSide::Over> LineSide::TakeEnd() {
  std::optional<ExchangeEnd> end = run_.TakeEnd();
  if (!end) return std::nullopt;
  const Job& job = *run_.job();
  Over over{.member = job.member, .end = std::move(*end), .seen = {}};
  over.seen = reception_.Assess(job, over.end);
  return over;
}

void LineSide::PassToJob(Over over) {
  if (!ProvesLife(over.end.outcome)) {
    const bool closed = over.end.outcome == Outcome::line_down;
    if (port_.IsUnsent()) {
      run_.NeverLeft();
      if (!closed) over.end.reason = kNotConnected;
    }
    if (!closed) port_.DropUnsent();
  }
  run_.FollowUp(std::move(over.end), over.seen.finding);
}

void LineInputs::OnTime(Now now) {
  arrival_.OnInput(now.instant, IsAwaiting());
  accounts_.OnTime(now, !line_.idle(), line_.member(), !line_.asks());
}

std::optional<Instant> LineInputs::Deadline() const {
  return Soonest(
      {line_.Deadline(), IsAwaiting() ? std::optional(arrival_.NextLook()) : std::nullopt});
}

void LineInputs::OnClosed(const std::string& reason, Now now) {
  LineNews news = line_.OnClosed();
  if (news.end) news.end->reason = reason;
  Apply(std::move(news), now);
  HandleEnd();
  line_.OnPortClosed(reason);
}

void LineInputs::HandleBytes(View bytes, Now now) {
  LineSide::Received received = line_.FeedLine(bytes, now.instant);
  const EchoWatch::Received& heard = received.heard;
  accounts_.line.OnHeard(heard, received.member);
  Apply(std::move(received.collided), now);
  if (heard.bytes.empty()) return;
  unasked_.Overhear(heard.bytes, now.instant);
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

/// The news of one input, in their order. HandleEnd applies the end of an exchange.
void LineInputs::Apply(LineNews news, Now now) {
  Date(news, now.instant);
  unasked_.OnInput(news.unasked, now);
  if (news.send) Send(now);
  if (news.stray_before.count > 0) HandleStray(news.stray_before, now.instant);
  if (news.end) line_.KeepEnd(std::move(*news.end));
  if (news.stray.count > 0) HandleStray(news.stray, now.instant);
  if (news.second_reply) tracker_.OnSecondReply(now.instant);
}

void LineInputs::Send(Now now) {
  for (const EarlierFinding& changed : line_.TakeChanged()) {
    accounts_.devices.OnMore(*changed.member, changed.finding, changed.back);
    // The line's patience with this device does not grow: its neighbours would pay for it.
    if (changed.lateness > Duration::zero()) {
      tracker_.CountLate(*changed.member, changed.lateness, now.instant);
    }
  }
  line_.Send(now);
}

void LineInputs::HandleStray(const StrayBytes& stray, Instant now) {
  const LateReplies::StrayEffects effects = tracker_.ApplyStray(stray, now);
  if (effects.warned != nullptr) accounts_.line.Warn(*effects.warned, effects.warning);
}

void LineInputs::HandleEnd() {
  std::optional<LineSide::Over> over = line_.TakeEnd();
  if (!over) return;
  if (over->seen.no_echo) accounts_.line.OnNoEcho();
  accounts_.line.OnRing(*over->member, over->seen.cut);
  if (over->seen.negotiates) accounts_.line.OnNegotiation();
  line_.PassToJob(std::move(*over));
}

}  // namespace baudgate
