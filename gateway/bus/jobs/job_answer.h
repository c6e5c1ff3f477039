// Decides what an exchange leads to: the next request, the same one again, or the end of the job. A
// part of gateway/bus/jobs/job_run.h, whose table has all states of a job.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/finding.h"
#include "gateway/base/time.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/chooser.h"
#include "gateway/bus/jobs/effect_applier.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/next_step.h"
#include "gateway/bus/jobs/parked_jobs.h"
#include "gateway/bus/jobs/upkeep.h"
#include "gateway/bus/replies/whose_reply.h"

namespace baudgate {

class JobAnswer {
 public:
  /// All outlive it.
  JobAnswer(WhoseReply& whose, const Chooser& chooser, const ParkedJobs& parked, Upkeep& upkeep,
            EffectApplier& effects)
      : whose_(whose), chooser_(chooser), parked_(parked), upkeep_(upkeep), effects_(effects) {}

  /// The exchange is over; `finding`: how it looked.
  NextStep Conclude(Job& job, ExchangeEnd end, const Finding& finding, Now now);
  /// Its answer counts.
  NextStep Take(Job& job, Instant now);

 private:
  NextStep OnAnswered(Job& job, const ExchangeEnd& end, Now now);
  NextStep OnRoutedAnswer(Job& job, const ExchangeEnd& end);
  NextStep OnFailed(Job& job, const ExchangeEnd& end, Instant now);
  NextStep OnRoutedFailure(Job& job, Job::Routed& routed, const ExchangeEnd& end);
  NextStep GiveUp(Job& job, const ExchangeEnd& end, Instant now);
  NextStep Repeat(Job& job);
  bool MustRepeat(const Job& job, Instant now) const;
  bool MayPark(const Job& job, Outcome outcome) const;

  WhoseReply& whose_;
  const Chooser& chooser_;
  const ParkedJobs& parked_;
  Upkeep& upkeep_;
  EffectApplier& effects_;
};

}  // namespace baudgate
