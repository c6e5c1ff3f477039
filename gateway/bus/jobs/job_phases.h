// Groups the parts that decide about one phase of a job each, for gateway/bus/jobs/job_run.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/bus/jobs/chooser.h"
#include "gateway/bus/jobs/effect_applier.h"
#include "gateway/bus/jobs/job_answer.h"
#include "gateway/bus/jobs/job_asking.h"
#include "gateway/bus/jobs/job_departure.h"
#include "gateway/bus/jobs/job_finish.h"
#include "gateway/bus/jobs/job_sending.h"
#include "gateway/bus/jobs/line_knowledge.h"

namespace baudgate {

struct JobPhases {
  /// All outlive it.
  JobPhases(LineKnowledge& knows, Chooser& chooser, EffectApplier& effects)
      : asking(knows.agenda.probes, knows.ledger.devices),
        departure(knows.owed.whose, knows.owed.late, chooser, knows.agenda),
        sending(knows.owed, knows.agenda.turns, knows.agenda.write_queue, knows.ledger.line),
        answer(knows.owed.whose, chooser, knows.agenda.parked, knows.upkeep, effects),
        finish(knows.owed.whose, knows.agenda.schedule, knows.upkeep, effects) {}

  JobAsking asking;
  JobDeparture departure;
  JobSending sending;
  JobAnswer answer;
  JobFinish finish;
};

}  // namespace baudgate
