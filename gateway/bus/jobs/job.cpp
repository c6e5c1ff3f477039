// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/job.h"

#include <algorithm>
#include <utility>

namespace baudgate {

Job::Job(Member& who, std::variant<Poll, Events, Background, Probe, ReadBack, Write, Routed> kind,
         Task what, Instant now)
    : member(&who), kind(std::move(kind)), task(std::move(what)), began(now) {
  if (As<Poll>() == nullptr && As<ReadBack>() == nullptr) return;
  const auto queries = member->device->conversation->Queries();
  if (task.query < queries.size()) points = queries[task.query].points;
}

void FollowPlan(Job& job) {
  if (job.As<Job::Poll>() == nullptr && job.As<Job::ReadBack>() == nullptr) return;
  const auto queries = job.member->device->conversation->Queries();
  const auto is_its = [&job](const Query& query) { return query.points == job.points; };
  if (job.task.query < queries.size() && is_its(queries[job.task.query])) return;
  const auto found = std::ranges::find_if(queries, is_its);
  const bool is_one = std::ranges::count_if(queries, is_its) == 1;
  job.task.query = is_one ? static_cast<std::size_t>(found - queries.begin()) : queries.size();
}

bool IsPlanned(const Task& task, const Conversation& conversation) {
  if (task.kind == Task::Kind::events) return conversation.HasEvents();
  if (task.kind == Task::Kind::background) return conversation.BackgroundDue().has_value();
  return task.kind != Task::Kind::poll || task.query < conversation.Queries().size();
}

void BeginNextPoints(Job& job) {
  Job::Write& write = *job.As<Job::Write>();
  std::vector<PointValue> rest;
  for (std::size_t i = write.next; i < write.command.writes().size(); ++i) {
    rest.push_back({write.command.writes()[i].point, write.command.writes()[i].raw});
  }
  Conversation& conversation = *job.member->device->conversation;
  rest.resize(std::clamp<std::size_t>(conversation.WritesTogether(rest), 1, rest.size()));
  write.first = std::exchange(write.next, write.next + rest.size());
  write.told.reset();
  write.may_have_acted = false;
  job.task.kind = Task::Kind::write;
  job.task.point = rest.front().point;
  job.task.value = rest.front().value;
  job.task.also.assign(rest.begin() + 1, rest.end());
}

bool ReadsBack(const Job& job, const Member& member) {
  const Job& goal = job.goal();
  return job.member == &member && goal.As<Job::ReadBack>() != nullptr && !goal.had_failure &&
         !job.had_failure;
}

LineUse UseOf(const Job& job) {
  if (job.As<Job::Routed>() != nullptr) return LineUse::routes;
  if (job.is_probe()) return LineUse::probes;
  const bool writes = job.As<Job::Write>() != nullptr || job.As<Job::ReadBack>() != nullptr;
  return writes ? LineUse::writes : LineUse::polls;
}

bool IsUrgent(const Job& job) {
  if (job.As<Job::Write>() != nullptr || job.As<Job::ReadBack>() != nullptr) return true;
  const auto* routed = job.As<Job::Routed>();
  const RoutedRequest* const first = routed != nullptr ? routed->first() : nullptr;
  return first != nullptr && RouteQueue::IsShortWrite(*first);
}

std::optional<Instant> LatestStart(const Job& job) {
  if (job.step.request.closes) return std::nullopt;
  if (const auto* write = job.As<Job::Write>()) return write->command.deadline;
  const auto* routed = job.As<Job::Routed>();
  if (routed == nullptr) return std::nullopt;
  if (routed->batch.empty()) return Instant{};  // nobody waits any more
  return std::ranges::max(routed->batch, {}, &RoutedRequest::deadline).deadline;
}

std::optional<Withheld> WhyNotSend(const Job& job, Instant now, bool held) {
  constexpr auto kNotSent = WriteEnd::not_sent;
  if (job.step.request.closes) return std::nullopt;
  if (job.As<Job::Routed>() == nullptr && !job.member->in_use) {
    return Withheld{kNotSent, "the device is disabled"};
  }
  const auto* write = job.As<Job::Write>();
  const bool untouched = write != nullptr && write->first == 0 &&
                         !(held ? write->may_have_written_before : write->sent());
  if (untouched && write->command.client_left()) return Withheld{kNotSent, kClientLeft};
  const auto latest = LatestStart(job);
  if (latest && *latest <= now) return Withheld{kNotSent, kTooLate};
  if (write == nullptr || !write->command.why_not) return std::nullopt;
  auto forbidden = write->command.why_not(now);
  if (!forbidden) return std::nullopt;
  return Withheld{WriteEnd::denied, std::move(*forbidden)};
}

}  // namespace baudgate
