// Asks the conversation of a job for its next request. A part of gateway/bus/jobs/job_run.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/time.h"
#include "gateway/bus/counters/device_accounts.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/next_step.h"
#include "gateway/bus/schedule/probes.h"

namespace baudgate {

class JobAsking {
 public:
  /// Both outlive it.
  JobAsking(Probes& probes, DeviceAccounts& accounts) : probes_(probes), accounts_(accounts) {}

  /// Puts the request into the job. `retries`: see Job::Step.
  NextStep Ask(Job& job, int retries, Instant now);

 private:
  Probes& probes_;
  DeviceAccounts& accounts_;
};

}  // namespace baudgate
