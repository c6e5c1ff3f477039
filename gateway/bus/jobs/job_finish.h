// The end of a job, and what goes on after it: the job that has waited for its probe, or the points
// of a write that remain. What each kind of job leads to is in job_end.h; effect_applier.h applies
// it. A part of gateway/bus/jobs/job_run.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "gateway/base/time.h"
#include "gateway/bus/jobs/effect_applier.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/next_step.h"
#include "gateway/bus/jobs/upkeep.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/bus/schedule/schedule.h"

namespace baudgate {

class JobFinish {
 public:
  /// All outlive it.
  JobFinish(WhoseReply& whose, const Schedule& schedule, Upkeep& upkeep, EffectApplier& effects)
      : whose_(whose), schedule_(schedule), upkeep_(upkeep), effects_(effects) {}

  /// The job that is under way now, and its next step. Null: none.
  struct After {
    std::unique_ptr<Job> job;
    NextStep next;
  };
  After Finish(std::unique_ptr<Job> done, const JobEnd& end, Instant now);
  /// The probe cannot be asked, which says nothing of the device. A reply whose owner is not proven
  /// yet is not taken.
  After GoUnproved(std::unique_ptr<Job> probe, const std::string& why, Instant now);

 private:
  After Resume(Job& probe, const JobEnd& end, Instant now);

  WhoseReply& whose_;
  const Schedule& schedule_;
  Upkeep& upkeep_;
  EffectApplier& effects_;
};

}  // namespace baudgate
