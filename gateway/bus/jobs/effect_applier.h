// Applies what follows from a reply (intake.h) or from the end of a job
// (gateway/bus/schedule/effects.h), field by field: to the schedule, the queues, the accounts and
// the store. Decides nothing.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/bus/jobs/intake.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/job_end.h"
#include "gateway/bus/jobs/upkeep.h"
#include "gateway/bus/schedule/effects.h"

namespace baudgate {

class EffectApplier {
 public:
  /// All references outlive it.
  EffectApplier(OwedReplies& owed, Agenda& agenda, Ledger& ledger, Upkeep& upkeep, Intake& intake)
      : owed_(owed), agenda_(agenda), ledger_(ledger), upkeep_(upkeep), intake_(intake) {}

  /// The answer to a request of `job` counts.
  void OnReply(const Job& job, Device& device, Answer answer, Instant now);
  /// Its events are on the disk. `said`: see Conversation.
  void OnEventsKept(const Device& device, const std::string& said, Instant now);
  /// Another device answers in its place.
  void OnReplaced(Device& device, Now now) {
    upkeep_.OnReplaced(device, now);
    intake_.OnReplaced(device);
  }
  /// A request to the member is repeated.
  void OnRetry(const Member& member) { ledger_.devices.OnRetry(member); }
  /// Answers the clients of the job. Returns a write of which points remain to be written.
  std::optional<Job::Write> OnEnd(Job& done, EndEffects effects, const JobEnd& end, Instant now);

 private:
  std::optional<Job::Write> OnWriteEnd(Job::Write& write, Device& device,
                                       const EndEffects::Write& effects, Instant now);

  OwedReplies& owed_;
  Agenda& agenda_;
  Ledger& ledger_;
  Upkeep& upkeep_;
  Intake& intake_;
};

}  // namespace baudgate
