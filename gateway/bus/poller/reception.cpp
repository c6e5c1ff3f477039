// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/poller/reception.h"

#include <utility>

namespace baudgate {

void Reception::OnOpened() {
  judge_.OnOpened();
  echo_.OnOpened();
  examiner_.OnOpened();
}

std::vector<Examiner::Earlier> Reception::TakeChanged() {
  std::vector<Examiner::Earlier> changed;
  if (auto more = examiner_.More()) changed.push_back({examiner_.member(), std::move(*more)});
  while (auto earlier = examiner_.TakeEarlier()) changed.push_back(std::move(*earlier));
  return changed;
}

void Reception::OnSend(const Job& job, Instant now) {
  examiner_.Begin(*job.member, job.step.request, job.member->times, now);
  echo_.OnSent(job.step.request.bytes);
}

EchoWatch::Received Reception::OnBytes(View bytes, const Job* job, Instant now) {
  EchoWatch::Received heard =
      echo_.OnReceived(bytes, job != nullptr ? &job->step.request : nullptr);
  if (!heard.bytes.empty()) examiner_.Hear(heard.bytes, now);
  return heard;
}

Outcome Reception::Judge(Job& job, View frame, Instant now) {
  examiner_.Take(frame);
  return judge_.Judge(job, frame, echo_.MayBeEcho(job.step.request, frame), now);
}

Reception::Seen Reception::OnEnd(const Job& job, ExchangeEnd& end) {
  Seen seen;
  seen.no_echo = echo_.OnExchangeEnd(job.step.request, end);
  seen.cut = echo_.is_cut();
  seen.finding = examiner_.End(end.outcome);
  seen.negotiates = examiner_.TakeNegotiation();
  judge_.OnEnd(job, end, echo_.echoed(), seen.finding);
  return seen;
}

}  // namespace baudgate
