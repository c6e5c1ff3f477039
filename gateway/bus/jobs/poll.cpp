// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/poll.h"

#include "gateway/bus/jobs/events.h"
#include "gateway/bus/jobs/line_context.h"

namespace baudgate::bus {

std::unique_ptr<Job> PollSource::Take(const Idle& idle) {
  const auto pick = line_.agenda.schedule.Next(idle.now, line_.agenda.turns.HealthyFirst());
  if (!pick) return nullptr;
  Device& device = line_.roster.device(pick->device);
  if (pick->query == kEventsQuery) return std::make_unique<EventsJob>(device, idle.now);
  return std::make_unique<PollJob>(device, *pick, idle.now);
}

std::optional<Instant> PollSource::NextAt(const Idle& /*idle*/) const {
  return line_.agenda.schedule.NextDue();
}

}  // namespace baudgate::bus
