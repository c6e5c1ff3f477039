// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job_sending.h"

#include <cstddef>
#include <vector>

namespace baudgate {

Exchange JobSending::Start(Job& job, Instant idle_since, Instant now) {
  const Device* const device = job.member->device;
  const bool trusted = device != nullptr && device->config->trust_order;
  job.step.waiting = false;
  job.attempt = {.began = now, .sent_at = now, .job_was_sent = job.was_sent};
  return owed_.ExchangeOf(job.asked(), trusted, idle_since, now);
}

const Request& JobSending::Send(Job& job, Now now) {
  Request& request = job.step.request;
  if (request.stamped) {
    const Duration character = job.member->times.character;
    const Duration takes = TransmissionTime(request, character);
    job.member->device->conversation->Stamp(request, {now.instant + takes, now.wall + takes},
                                            character);
  }
  if (auto* const write = job.As<Job::Write>()) {
    write->may_have_written_before = write->sent();
    if (!request.prepares && !request.closes) NoteWriting(*write, *job.member->device);
  }
  turns_.OnSent(IsUrgent(job.goal()));
  owed_.whose.OnSent(job.asked(), now.instant);
  if (job.probe_budget && !job.was_sent) account_.OnProbe();
  account_.OnSent(*job.member, request);
  job.attempt.sent_at = now.instant;
  job.was_sent = true;
  return request;
}

/// A request that may write the points under way goes out.
void JobSending::NoteWriting(Job::Write& write, const Device& device) {
  write.command.MoveTo(WriteState::sent);
  write.told.reset();
  std::vector<std::size_t> points;
  for (std::size_t i = write.first; i < write.next; ++i) {
    points.push_back(write.command.writes()[i].point);
    writes_.OnBegun(device.index, write.command.writes()[i].point);
  }
  writes_.AddReadBacks(device.place, device.conversation->Queries(), points);
}

void JobSending::NeverLeft(Job& job) {
  job.was_sent = job.attempt.job_was_sent;
  auto* const write = job.As<Job::Write>();
  if (write != nullptr && write->sent() && !write->may_have_written_before) {
    write->command.MoveTo(WriteState::queued);
  }
}

}  // namespace baudgate
