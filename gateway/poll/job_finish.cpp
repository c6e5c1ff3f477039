// The end of a job: what goes on after it. What each kind of job leads to is in job_end.h;
// effect_applier.h applies it.
// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "gateway/poll/job_end.h"
#include "gateway/poll/job_run.h"

namespace baudgate {

void JobRun::Finish(Outcome outcome, const std::string& reason) {
  const std::unique_ptr<Job> done = std::move(job_);
  if (done->postponed) return Resume(*done, outcome, reason);
  FollowPlan(*done);  // its own answer may have changed it
  const JobEnd end{outcome, reason};
  auto rest = effects_.OnEnd(*done, EffectsOf(*done, end, now_.instant), end, now_.instant);
  if (!rest) return;
  Begin(std::make_unique<Job>(*done->member, std::move(*rest), Task{}, now_.instant));
}

/// If the probe has failed, the task ends as the probe did. If the probe was refused, the task was
/// not sent; if it only says ok, the task ends as busy. That a device answers probes does not make
/// up for polls that fail.
void JobRun::Resume(Job& probe, Outcome outcome, const std::string& reason) {
  Member& member = *probe.member;
  const bool life = ProvesLife(outcome);
  if (member.device != nullptr) upkeep_.PlanBackground(*member.device);
  if (!life || member.health.state() == DeviceState::never_seen) {
    upkeep_.OnTask(member, outcome, reason, now_.instant);
  }
  job_ = std::move(probe.postponed);
  job_->proved = true;
  job_->wire += probe.wire;
  // A device that wants to be left in peace gets it: a meter counts wrong passwords.
  const bool in_peace = agenda_.schedule.held_until(member.place) > now_.instant;
  const bool is_write = job_->As<Job::Write>() != nullptr;
  const bool allowed = !in_peace || (is_write && outcome == Outcome::ok);
  if (life && member.in_use && owed_.whose.orders().MayBeInStep(job_->asked()) && allowed) {
    if (job_->has_news()) return TakeAnswer();  // only its proof was awaited
    return GoOn();
  }
  if (!member.in_use) return EndUnproved(Outcome::no_reply, "the device is disabled");
  if (outcome == Outcome::refused || outcome == Outcome::unsupported) {
    return EndUnproved(Outcome::no_reply, "the probe before it was answered: " + reason);
  }
  EndUnproved(outcome == Outcome::ok ? Outcome::busy : outcome, reason);
}

/// The probe cannot be asked, which says nothing of the device. A reply that waits for a proof of
/// whose it is is not taken.
void JobRun::GoOnUnproved(const std::string& why) {
  std::unique_ptr<Job> waiting = std::move(job_->postponed);
  job_ = std::move(waiting);
  job_->unprovable = true;
  owed_.whose.OnNoProof(*job_->member->device);
  if (job_->has_news()) return EndUnproved(Outcome::busy, why);
  GoOn();
}

/// The job whose probe is over has its request again.
void JobRun::GoOn() {
  if (job_->As<Job::Routed>() != nullptr) return;  // its request is as it was
  job_->requests = job_->broadcasts = 0;
  Ask();
}

void JobRun::EndUnproved(Outcome outcome, const std::string& reason) {
  job_->judges_member = false;
  if (job_->attempt.answer.batch) {
    job_->member->device->conversation->OnFailure(job_->task, job_->step.request,
                                                  Outcome::unexpected, now_.instant);
  }
  Finish(outcome, reason);
}

}  // namespace baudgate
