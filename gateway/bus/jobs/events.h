// A request for the events of a device. It is due as often as the fast polls (PollSource).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/bus/jobs/job.h"

namespace baudgate::bus {

class EventsJob final : public Job {
 public:
  EventsJob(Member& who, Instant now) : Job(who, {.kind = protocols::Task::Kind::events}, now) {}
};

}  // namespace baudgate::bus
