// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job_finish.h"

#include <utility>

namespace baudgate {
namespace {

/// The job whose probe is over has its request again.
NextStep GoOn(Job& job) {
  if (job.As<Job::Routed>() != nullptr) return NextStep::Wait();  // its request is as it was
  job.requests = job.broadcasts = 0;
  return NextStep::Ask();
}

NextStep EndUnproved(Job& job, Outcome outcome, const std::string& reason, Instant now) {
  job.judges_member = false;
  if (job.attempt.answer.batch) {
    job.member->device->conversation->OnFailure(job.task, job.step.request, Outcome::unexpected,
                                                now);
  }
  return NextStep::Finish(outcome, reason);
}

}  // namespace

JobFinish::After JobFinish::Finish(std::unique_ptr<Job> done, const JobEnd& end, Instant now) {
  if (done->postponed) return Resume(*done, end, now);
  FollowPlan(*done);  // its own answer may have changed it
  auto rest = effects_.OnEnd(*done, EffectsOf(*done, end, now), end, now);
  if (!rest) return {};
  auto job = std::make_unique<Job>(*done->member, std::move(*rest), Task{}, now);
  BeginNextPoints(*job);
  return {std::move(job), NextStep::Ask()};
}

/// The probe that went before a task is over. The task goes on if the device has answered, its
/// replies are in order, and it does not want to be left in peace. Else the task ends:
///
///   the probe                     the task ends as
///   has failed                    the probe has
///   was refused, or unknown       no_reply: it was not sent
///   was answered with busy, ok    busy
///   its device is disabled now    no_reply
///
/// A good probe is not counted for a device that has been seen: that it answers probes does not
/// make up for polls that fail.
JobFinish::After JobFinish::Resume(Job& probe, const JobEnd& end, Instant now) {
  const auto& [outcome, reason] = end;
  Member& member = *probe.member;
  const bool life = ProvesLife(outcome);
  if (member.device != nullptr) upkeep_.PlanBackground(*member.device);
  if (!life || member.health.state() == DeviceState::never_seen) {
    upkeep_.OnTask(member, outcome, reason, now);
  }
  std::unique_ptr<Job> job = std::move(probe.postponed);
  job->proved = true;
  job->wire += probe.wire;
  // A device that wants to be left in peace gets it: a meter counts wrong passwords.
  const bool in_peace = schedule_.held_until(member.place) > now;
  const bool is_write = job->As<Job::Write>() != nullptr;
  const bool allowed = !in_peace || (is_write && outcome == Outcome::ok);
  NextStep next;
  if (life && member.in_use && whose_.MayBeInStep(job->asked()) && allowed) {
    next = job->has_news() ? NextStep::TakeAnswer() : GoOn(*job);  // only its proof was awaited
  } else if (!member.in_use) {
    next = EndUnproved(*job, Outcome::no_reply, "the device is disabled", now);
  } else if (outcome == Outcome::refused || outcome == Outcome::unsupported) {
    next = EndUnproved(*job, Outcome::no_reply, "the probe before it was answered: " + reason, now);
  } else {
    next = EndUnproved(*job, outcome == Outcome::ok ? Outcome::busy : outcome, reason, now);
  }
  return {std::move(job), std::move(next)};
}

JobFinish::After JobFinish::GoUnproved(std::unique_ptr<Job> probe, const std::string& why,
                                       Instant now) {
  std::unique_ptr<Job> job = std::move(probe->postponed);
  job->unprovable = true;
  whose_.OnNoProof(*job->member->device, now);
  NextStep next = job->has_news() ? EndUnproved(*job, Outcome::busy, why, now) : GoOn(*job);
  return {std::move(job), std::move(next)};
}

}  // namespace baudgate
