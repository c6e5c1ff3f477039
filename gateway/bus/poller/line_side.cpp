// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/line_side.h"

#include <utility>

#include "gateway/base/deadline.h"

namespace baudgate {

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

LineSide::Received LineSide::OnBytes(View bytes, Instant now) {
  const Job* const job = run_.job();
  Received received{.member = job != nullptr ? job->member : nullptr,
                    .heard = reception_.OnBytes(bytes, job, now),
                    .collided = {},
                    .news = {}};
  if (received.heard.collision) received.collided = line_.OnCollision(now);
  if (!received.heard.bytes.empty()) received.news = line_.OnBytes(received.heard.bytes, now);
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

void LineSide::OnEnd(ExchangeEnd end) {
  if (run_.job() != nullptr) run_.OnEnd(std::move(end));
}

std::optional<LineSide::Over> LineSide::TakeEnd() {
  std::optional<ExchangeEnd> end = run_.TakeEnd();
  if (!end) return std::nullopt;
  const Job& job = *run_.job();
  Over over{.member = job.member, .end = std::move(*end), .seen = {}};
  over.seen = reception_.OnEnd(job, over.end);
  return over;
}

void LineSide::Conclude(Over over) {
  if (!ProvesLife(over.end.outcome)) {
    const bool closed = over.end.outcome == Outcome::line_down;
    if (port_.IsUnsent()) {
      run_.NeverLeft();
      if (!closed) over.end.reason = kNotConnected;
    }
    if (!closed) port_.DropUnsent();
  }
  run_.Conclude(std::move(over.end), over.seen.finding);
}

}  // namespace baudgate
