// `ReadBackJob` reads one query as soon as possible, because its points were written, are
// uncertain, or are wanted at once by a client.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "gateway/bus/jobs/line_context.h"
#include "gateway/bus/jobs/poll.h"

namespace baudgate::bus {

class ReadBackJob final : public QueryJob {
 public:
  using QueryJob::QueryJob;

  LineUse use() const override { return LineUse::writes; }
  bool is_urgent() const override { return true; }
  bool is_read_back() const override { return true; }
  bool ReadsBack(const Member& of) const override { return member == &of && !had_failure; }

 protected:
  void End(const JobEnd& end, Instant /*now*/, EndEffects& effects) override {
    if (points.empty()) return;
    if (unplanned) effects.read_again = points;
    const config::Group group = member->device->config->points[points.front()].group;
    if (IsUnread(end) && IsSeldom(group)) effects.repeat = EndEffects::Repeat{group};
    // The device did not answer. Other points of the query may have changed with the written point,
    // so all points of the query become uncertain.
    if (!ProvesLife(end.outcome)) effects.doubt = points;
  }
};

class ReadBackSource final : public JobSource {
 public:
  explicit ReadBackSource(LineContext& line) : line_(line) {}

  std::unique_ptr<Job> Take(const Idle& idle) override;
  std::optional<Instant> NextAt(const Idle& idle) const override;

 private:
  LineContext& line_;
};

inline std::unique_ptr<Job> ReadBackSource::Take(const Idle& idle) {
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

inline std::optional<Instant> ReadBackSource::NextAt(const Idle& idle) const {
  std::optional<Instant> soonest;
  for (const QueryRef& query : line_.agenda.write_queue.read_backs()) {
    const Instant held = line_.agenda.schedule.held_until(query.device);
    if (held > idle.now) soonest = Soonest({soonest, held});
    soonest = Soonest({soonest, line_.ClearsAt(line_.roster.device(query.device), idle.now)});
  }
  return soonest;
}

}  // namespace baudgate::bus
