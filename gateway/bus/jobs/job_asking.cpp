// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job_asking.h"

#include <algorithm>
#include <string>
#include <utility>

namespace baudgate {

NextStep JobAsking::Ask(Job& job, int retries, Instant now) {
  if (++job.requests > kMostSteps) {
    return NextStep::Finish(Outcome::unexpected, "the task needed more than " +
                                                     std::to_string(kMostSteps) + " requests");
  }
  Conversation& conversation = *job.member->device->conversation;
  FollowPlan(job);
  if (!IsPlanned(job.task, conversation)) {
    job.judges_member = false;
    job.unplanned = true;
    return NextStep::Finish(
        Outcome::busy, "the query no longer exists: the points of the device were planned again");
  }
  auto request = conversation.Ask(job.task, now);
  if (job.is_probe()) {
    probes_.OnAsked(*job.member, bool(request), now);
    if (!request && job.postponed) return NextStep::GoUnproved(request.error());
  }
  if (!request) {
    job.judges_member = false;
    job.unasked = true;
    if (!job.is_probe()) accounts_.OnUnsupported(*job.member, request.error());
    return NextStep::Finish(Outcome::unsupported, request.error());
  }
  if (job.probe_budget == Probes::Kind::rested_look) {
    request->quiet = std::max(request->quiet, Probes::kRest);
  }
  job.step = {.request = std::move(*request), .waiting = true, .retries = retries};
  return NextStep::Wait();
}

}  // namespace baudgate
