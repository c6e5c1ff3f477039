// `PollJob` reads one query of a device when its group of queries is due
// (gateway/bus/schedule/schedule.h). `QueryJob` is the common base of polls and read-backs: it
// finds its query again by its points if the queries of the device get other numbers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <utility>

#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/line_context.h"
#include "gateway/bus/points/readings.h"

namespace baudgate::bus {

class QueryJob : public Job {
 public:
  QueryJob(Member& who, std::size_t query, Instant now)
      : Job(who, {.kind = protocols::Task::Kind::poll, .query = query}, now) {
    const auto queries = member->device->conversation->Queries();
    if (query < queries.size()) points = queries[query].points;
  }

  void FollowPlan() override {
    const auto queries = member->device->conversation->Queries();
    const auto is_its = [this](const protocols::Query& query) { return query.points == points; };
    if (task.query < queries.size() && is_its(queries[task.query])) return;
    const auto found = std::ranges::find_if(queries, is_its);
    const bool is_one = std::ranges::count_if(queries, is_its) == 1;
    task.query = is_one ? static_cast<std::size_t>(found - queries.begin()) : queries.size();
  }

 protected:
  /// True if the points were not read: the query no longer exists, or the device did not answer
  /// (perhaps it does not have the points) or was busy.
  bool IsUnread(const JobEnd& end) const {
    return unplanned || !ProvesLife(end.outcome) || end.outcome == Outcome::busy;
  }
};

class PollJob final : public QueryJob {
 public:
  PollJob(Member& who, const Schedule::Pick& pick, Instant now)
      : QueryJob(who, pick.query, now), group_(pick.group), last_of_round_(pick.last_of_round) {}

  std::optional<config::Group> group() const override { return group_; }

 protected:
  void End(const JobEnd& end, Instant /*now*/, EndEffects& effects) override {
    const bool answered = ProvesLife(end.outcome);
    if (group_ == config::Group::fast) {
      effects.fast_poll = FastRounds::Poll{wire, answered, last_of_round_};
    }
    if (judges_member) effects.poll = EndEffects::Poll{task.query, answered};
    // The group is polled again soon if the query was not sent, or if its reply belonged to another
    // request.
    const bool soon = !judges_member || end.outcome == Outcome::unexpected;
    if (soon || (IsUnread(end) && IsSeldom(group_))) {
      effects.repeat = EndEffects::Repeat{group_, soon};
    }
  }

 private:
  const config::Group group_;
  const bool last_of_round_;
};

// `EventsJob` asks a device for its events. It is due as often as polls of the group `fast`.
class EventsJob final : public Job {
 public:
  EventsJob(Member& who, Instant now) : Job(who, {.kind = protocols::Task::Kind::events}, now) {}
};

class PollSource final : public JobSource {
 public:
  explicit PollSource(LineContext& line) : line_(line) {}

  std::unique_ptr<Job> Take(const Idle& idle) override;
  std::optional<Instant> NextAt(const Idle& idle) const override;

 private:
  LineContext& line_;
};

inline std::unique_ptr<Job> PollSource::Take(const Idle& idle) {
  const auto pick = line_.agenda.schedule.Next(idle.now, line_.agenda.turns.HealthyFirst());
  if (!pick) return nullptr;
  Device& device = line_.roster.device(pick->device);
  if (pick->query == kEventsQuery) return std::make_unique<EventsJob>(device, idle.now);
  return std::make_unique<PollJob>(device, *pick, idle.now);
}

inline std::optional<Instant> PollSource::NextAt(const Idle& /*idle*/) const {
  return line_.agenda.schedule.NextDue();
}

}  // namespace baudgate::bus
