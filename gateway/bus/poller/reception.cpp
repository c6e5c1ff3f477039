// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/reception.h"

#include <utility>

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

EchoWatch::Received Reception::OnBytes(View bytes, const Job* job, Instant now) {
  EchoWatch::Received heard =
      echo_.OnReceived(bytes, job != nullptr ? &job->step.request : nullptr);
  if (!heard.bytes.empty()) observer_.OnBytes(heard.bytes, now);
  return heard;
}

Outcome Reception::Judge(Job& job, View frame, Instant now) {
  observer_.OnReply(frame);
  return judge_.Judge(job, frame, echo_.MayBeEcho(job.step.request, frame), now);
}

Reception::Seen Reception::OnEnd(const Job& job, ExchangeEnd& end) {
  Seen seen;
  seen.no_echo = echo_.OnExchangeEnd(job.step.request, end);
  seen.cut = echo_.is_cut();
  seen.finding = observer_.OnEnd(end.outcome);
  seen.negotiates = observer_.TakeNegotiation();
  judge_.OnEnd(job, end, echo_.echoed(), seen.finding);
  return seen;
}

}  // namespace baudgate
