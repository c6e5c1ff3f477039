// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job_departure.h"

#include <utility>

#include "gateway/base/deadline.h"

namespace baudgate {
namespace {

/// The next step of a read waits for a late reply of its device. If replies carry an address, the
/// line does not wait.
bool MayPark(const Job& job, const ParkedJobs& parked) {
  const Task::Kind kind = job.task.kind;
  const bool reads =
      kind == Task::Kind::poll || kind == Task::Kind::events || kind == Task::Kind::background;
  return reads && job.asked().named() && !parked.HasLike(job);
}

/// The waiting request is not sent. What the job has begun is closed properly.
NextStep BreakOff(Job& job, const Withheld& withheld, Instant now) {
  job.judges_member = false;
  if (auto* const write = job.As<Job::Write>()) write->withheld = withheld;
  const bool asks = job.As<Job::Routed>() == nullptr;
  if (asks && job.begun()) {
    Conversation& conversation = *job.member->device->conversation;
    const Then then = conversation.OnFailure(job.task, job.step.request, Outcome::busy, now);
    if (then == Then::ask_again) return NextStep::Ask();
  }
  return NextStep::Finish(Outcome::no_reply, withheld.why);
}

}  // namespace

NextStep JobDeparture::Decide(Job& job, Instant now) {
  if (const auto withheld = WhyNotSend(job, now)) return BreakOff(job, *withheld, now);
  whose_.Recognise(*job.member, job.step.request.expect.address);
  if (whose_.NeedsProbeFirst(job.asked(), now)) {
    const Device& device = *job.member->device;
    const bool writes = job.As<Job::Write>() != nullptr;
    if (!writes || !whose_.IsProbedByWrites(device)) return NextStep::ProbeFirst();
    job.unprovable = true;
    whose_.OnNoProof(device, now);
  }
  // A retry does not wait: a late reply to its first try is as good as its own.
  const Instant clear = late_.ClearAt(job.asked());
  if (job.step.retries > 0 || clear <= now) return NextStep::Send();
  return MayPark(job, agenda_.parked) ? NextStep::Park(clear) : NextStep::Hold();
}

std::optional<Instant> JobDeparture::NextAt(const Job& job) const {
  const bool repeats = job.step.retries > 0;
  return Soonest({repeats ? std::nullopt : std::optional(late_.ClearAt(job.asked())),
                  LatestStart(job.goal())});
}

std::optional<NextStep> JobDeparture::Withdraw(Job& job, Instant now) {
  if (const auto withheld = WhyNotSend(job, now)) return BreakOff(job, *withheld, now);
  const auto* const routed = job.As<Job::Routed>();
  const bool lets_pass = routed != nullptr && routed->is_read && chooser_.ShortWriteGoesFirst(now);
  return lets_pass ? std::optional(NextStep::BackInQueue()) : std::nullopt;
}

void JobDeparture::Park(std::unique_ptr<Job> job, Instant until) {
  agenda_.schedule.Hold(job->member->place, until);
  agenda_.parked.Park(std::move(job), until);
}

}  // namespace baudgate
