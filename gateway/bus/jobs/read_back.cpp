// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/read_back.h"

#include "gateway/bus/jobs/line_context.h"

namespace baudgate::bus {

std::unique_ptr<Job> ReadBackSource::Take(const Idle& idle) {
  const auto may_go = [&](std::size_t device) {
    return line_.owed.late_replies.IsClear(line_.roster.device(device), idle.now) &&
           line_.agenda.schedule.held_until(device) <= idle.now;
  };
  while (const auto next = line_.agenda.write_queue.TakeReadBack(may_go)) {
    Device& device = line_.roster.device(next->device);
    const bool known = next->query < device.conversation->Queries().size();
    if (!known || !device.in_use || device.health.absent()) continue;
    return std::make_unique<ReadBackJob>(device, next->query, idle.now);
  }
  return nullptr;
}

std::optional<Instant> ReadBackSource::NextAt(const Idle& idle) const {
  std::optional<Instant> soonest;
  for (const QueryRef& query : line_.agenda.write_queue.read_backs()) {
    const Instant held = line_.agenda.schedule.held_until(query.device);
    if (held > idle.now) soonest = Soonest({soonest, held});
    soonest = Soonest({soonest, line_.ClearsAt(line_.roster.device(query.device), idle.now)});
  }
  return soonest;
}

}  // namespace baudgate::bus
