// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/chooser.h"

#include <algorithm>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::bus {

Turns::Waiting RoutedJobs::Waiting() const {
  const RouteQueue& queue = agenda_.route_queue;
  if (queue.empty()) return {};
  return {.short_write = ShortWriteWaits(),
          .routed = true,
          .high_clients = queue.Clients(config::Priority::high)};
}

bool RoutedJobs::AnyMayGo(Instant now) const {
  return agenda_.route_queue.HasAny(
      [&](const RoutedRequest& request) { return MayGo(request, now); });
}

bool RoutedJobs::ShortWriteMayGo(Instant now) const {
  return agenda_.route_queue.HasAny([&](const RoutedRequest& request) {
    return RouteQueue::IsShortWrite(request) && MayGo(request, now);
  });
}

bool RoutedJobs::ShortWriteWaits() const {
  return agenda_.route_queue.HasAny([this](const RoutedRequest& request) {
    if (!RouteQueue::IsShortWrite(request)) return false;
    const Member* member = roster_.FindSlave(request.slave);
    return member == nullptr || !member->health.absent();
  });
}

bool RoutedJobs::IsLookedFor(const Member& slave, const Idle& idle) const {
  if (slave.slave == 0) return false;
  return agenda_.route_queue.HasFor(slave.slave) ||
         agenda_.routes.MayRepeatRead(slave, idle.since == idle.now, idle.now);
}

/// Not while a late reply could pass for its own; and no write before an earlier one to a point of
/// the same device.
bool RoutedJobs::MayGo(const RoutedRequest& request, Instant now) const {
  const Member* member = roster_.FindSlave(request.slave);
  if (member != nullptr && (!late_.IsClear(*member, now) || member->health.absent())) return false;
  if (!IsWrite(request)) return true;
  const Device* device = member == nullptr ? nullptr : member->device;
  if (device != nullptr && agenda_.schedule.GoesFirst(device->place, now)) return false;
  return !agenda_.write_queue.HasAny([&](const WriteCommand& command) {
    const std::uint8_t slave = roster_.DeviceAt(command.device).slave;
    const bool same = slave != 0 && (slave == request.slave || request.slave == 0);
    return same && command.sequence < request.sequence;
  });
}

std::unique_ptr<Job> RoutedJobs::Take(config::Priority priority, Instant now) {
  const auto may_go = [&](const RoutedRequest& request) { return MayGo(request, now); };
  return JobOf(agenda_.route_queue.Take(priority, may_go), now);
}

std::unique_ptr<Job> RoutedJobs::TakeUrgent(Instant now) {
  const auto may_go = [&](const RoutedRequest& request) { return MayGo(request, now); };
  return JobOf(agenda_.route_queue.TakeUrgent(may_go), now);
}

std::unique_ptr<Job> RoutedJobs::TakeShortWrite(std::uint8_t slave, Instant now) {
  const auto to_it = [slave](const RoutedRequest& request) { return request.slave == slave; };
  return JobOf(agenda_.route_queue.TakeUrgent(to_it), now);
}

std::unique_ptr<Job> RoutedJobs::TakeProbe(const Member& slave, const Idle& idle) {
  auto job = JobOf(agenda_.route_queue.TakeFor(slave.slave), idle.now);
  if (!job && agenda_.routes.MayRepeatRead(slave, idle.since == idle.now, idle.now)) {
    job = JobOf(agenda_.routes.RepeatRead(slave), idle.now);
  }
  return job;
}

std::unique_ptr<Job> RoutedJobs::JobOf(RouteQueue::Batch batch, Instant now) {
  if (batch.empty()) return nullptr;
  const protocols::Protocol& protocol = *roster_.carrier();
  const RoutedRequest& first = batch.front();
  protocols::Request request;
  request.bytes = protocol.carrier->wrap(first.slave, first.pdu);
  Member& slave = roster_.SlaveAt(first.slave);
  request.expect = protocol.expect(request.bytes, slave.options);
  const bool common = protocol.carrier->is_common(first.pdu);
  const bool read = !IsWrite(first);
  auto job = std::make_unique<Job>(
      slave,
      Job::Routed{
          .batch = std::move(batch), .every_slave_answers = common, .reply = {}, .is_read = read},
      protocols::Task{}, now);
  job->step = {.request = std::move(request), .waiting = true};
  job->requests = 1;
  return job;
}

Chooser::Chooser(Roster& roster, Agenda& agenda, const LateReplies& late)
    : roster_(roster), agenda_(agenda), late_(late), routed_(roster, agenda, late) {}

void Chooser::OnTime(Duration passed, const Member* busy_with) {
  const bool failing = busy_with != nullptr && busy_with->device != nullptr &&
                       agenda_.schedule.failing(busy_with->place);
  agenda_.turns.OnTime(passed, failing);
}

std::unique_ptr<Job> Chooser::Next(const Idle& idle) {
  const Turns::Waiting waiting = routed_.Waiting();
  for (const Turns::Choice choice : agenda_.turns.Order(waiting)) {
    auto job = Take(choice, idle);
    if (!job) continue;
    agenda_.turns.OnTaken(choice, waiting);
    return job;
  }
  agenda_.turns.OnNothing();
  return TakeBackground(Background::Which::that_fits, idle.now);
}

std::unique_ptr<Job> Chooser::Take(Turns::Choice choice, const Idle& idle) {
  using Choice = Turns::Choice;
  switch (choice) {
    case Choice::urgent:
      return TakeUrgent(idle);
    case Choice::parked:
      return agenda_.parked.Take(idle.now);
    case Choice::probe:
      return TakeProbe(idle);
    case Choice::poll:
      return TakePoll(idle.now);
    case Choice::routed_high:
      return routed_.Take(config::Priority::high, idle.now);
    case Choice::routed_normal:
      return routed_.Take(config::Priority::normal, idle.now);
    case Choice::routed_low:
      return routed_.Take(config::Priority::low, idle.now);
  }
  return nullptr;
}

std::optional<Instant> Chooser::NextAt(const Idle& idle) const {
  std::optional<Instant> soonest;
  const auto sooner = [&soonest](std::optional<Instant> other) {
    soonest = Soonest({soonest, other});
  };
  const auto when_clear = [&](const Member& member) {
    if (!late_.IsClear(member, idle.now)) sooner(late_.LateUntil(member));
  };
  const Probes::Facts facts = FactsOf(idle);
  sooner(agenda_.schedule.NextDue());
  sooner(agenda_.background.NextAt(idle.now));
  sooner(agenda_.probes.NextAt(facts));
  sooner(agenda_.parked.NextAt());
  for (const QueryRef& query : agenda_.write_queue.read_backs()) {
    const Instant held = agenda_.schedule.held_until(query.device);
    if (held > idle.now) sooner(held);
    when_clear(roster_.device(query.device));
  }
  for (const WriteCommand& command : agenda_.write_queue.waiting()) {
    const Device& device = roster_.DeviceAt(command.device);
    when_clear(device);
    if (!device.health.absent()) continue;
    const Instant allowed = agenda_.probes.NextWriteAt(device, facts);
    if (allowed > idle.now) sooner(allowed);
  }
  for (const std::uint8_t slave : agenda_.route_queue.Slaves()) {
    const Member* member = roster_.FindSlave(slave);
    if (member == nullptr) continue;
    when_clear(*member);
    const bool tried = member->health.absent() && late_.IsClear(*member, idle.now);
    if (tried && agenda_.route_queue.HasUrgent(slave))
      sooner(agenda_.probes.NextWriteAt(*member, facts));
  }
  return soonest;
}

// ---------------------------------------------------------------- urgent

std::unique_ptr<Job> Chooser::TakeUrgent(const Idle& idle) {
  if (!agenda_.route_queue.empty()) {
    if (auto job = routed_.TakeUrgent(idle.now)) return job;
    if (auto job = TakeWriteProbe(idle)) return job;
  }
  // Read-backs before further writes: their clients are waiting.
  if (auto job = TakeReadBack(idle.now)) return job;
  return TakeCommand(idle);
}

std::unique_ptr<Job> Chooser::TakeWriteProbe(const Idle& idle) {
  const Probes::Facts facts = FactsOf(idle);
  for (const std::uint8_t slave : agenda_.route_queue.Slaves()) {
    const Member* member = roster_.FindSlave(slave);
    if (member == nullptr || !member->health.absent()) continue;
    if (!late_.IsClear(*member, idle.now)) continue;
    if (agenda_.probes.NextWriteAt(*member, facts) > idle.now) return nullptr;
    auto job = routed_.TakeShortWrite(slave, idle.now);
    if (!job) continue;
    job->probe_budget = Probes::Kind::short_write;
    return job;
  }
  return nullptr;
}

std::unique_ptr<Job> Chooser::TakeReadBack(Instant now) {
  while (true) {
    const auto next = agenda_.write_queue.TakeReadBack([this, now](std::size_t device) {
      return late_.IsClear(roster_.device(device), now) &&
             agenda_.schedule.held_until(device) <= now;
    });
    if (!next) return nullptr;
    Device& device = roster_.device(next->device);
    const auto queries = device.conversation->Queries();
    const bool known = next->query < queries.size();
    if (!known || !device.in_use || device.health.absent()) continue;
    return std::make_unique<Job>(
        device, Job::ReadBack{},
        protocols::Task{.kind = protocols::Task::Kind::poll, .query = next->query}, now);
  }
}

/// The first command whose device may be asked now; commands to one device keep their order, and so
/// do writes to one slave, whichever way they came. A write to an absent device, which nothing else
/// can find, must not take the line from the others.
std::unique_ptr<Job> Chooser::TakeCommand(const Idle& idle) {
  const Instant now = idle.now;
  std::optional<WriteCommand> next = agenda_.write_queue.Take([&](const WriteCommand& command) {
    const Device& device = roster_.DeviceAt(command.device);
    const auto routed =
        device.slave == 0 ? std::nullopt : agenda_.route_queue.FirstWrite(device.slave);
    if (routed && *routed < command.sequence) return false;
    if (agenda_.schedule.GoesFirst(device.place, now)) return false;
    const bool absent = device.health.absent();
    if (absent && agenda_.probes.NextWriteAt(device, FactsOf(idle)) > now) return false;
    return late_.IsClear(device, now);
  });
  if (!next) return nullptr;
  Device& device = roster_.DeviceAt(next->device);
  auto job = std::make_unique<Job>(device, Job::Write{.command = std::move(*next)},
                                   protocols::Task{}, now);
  if (device.health.absent()) job->probe_budget = Probes::Kind::short_write;
  return job;
}

// ---------------------------------------------------------------- polls and probes

std::unique_ptr<Job> Chooser::TakeBackground(Background::Which which, Instant now) {
  const auto place = agenda_.background.Next(which, now);
  if (!place) return nullptr;
  Device& device = roster_.device(*place);
  const bool renews =
      which == Background::Which::that_fits && agenda_.background.MayProve(*place, now);
  agenda_.background.OnTaken(*place, now);
  auto job = std::make_unique<Job>(device, Job::Background{},
                                   protocols::Task{.kind = protocols::Task::Kind::background}, now);
  job->renews_proof_early = renews;
  return job;
}

std::unique_ptr<Job> Chooser::TakePoll(Instant now) {
  if (auto job = TakeBackground(Background::Which::that_starves, now)) return job;
  const auto pick = agenda_.schedule.Next(now, agenda_.turns.HealthyFirst());
  if (!pick) return nullptr;
  if (pick->query == kEventsQuery) {
    return std::make_unique<Job>(roster_.device(pick->device), Job::Events{},
                                 protocols::Task{.kind = protocols::Task::Kind::events}, now);
  }
  return std::make_unique<Job>(
      roster_.device(pick->device), Job::Poll{pick->group, pick->last_of_round},
      protocols::Task{.kind = protocols::Task::Kind::poll, .query = pick->query}, now);
}

std::unique_ptr<Job> Chooser::TakeProbe(const Idle& idle) {
  const Probes::Facts facts = FactsOf(idle);
  const auto when = agenda_.probes.NextAt(facts);
  if (!when || *when > idle.now) return nullptr;
  Member& member = *agenda_.probes.Next(facts);
  const Probes::Kind kind = agenda_.probes.OnTaken(member, facts);
  std::unique_ptr<Job> job;
  if (member.device != nullptr && member.in_use) {
    job = std::make_unique<Job>(member, Job::Probe{},
                                protocols::Task{.kind = protocols::Task::Kind::probe}, idle.now);
  } else {
    job = routed_.TakeProbe(member, idle);
  }
  if (job) job->probe_budget = kind;
  return job;
}

Probes::Facts Chooser::FactsOf(const Idle& idle) const {
  const auto is_looked_for = [this, idle](const Member& one) {
    return (one.device != nullptr && one.in_use) || routed_.IsLookedFor(one, idle);
  };
  const bool now = agenda_.routes.ClientsAreHere(idle.now) || routed_.AnyMayGo(idle.now);
  return {
      .now = idle.now,
      .idle_since = idle.since,
      .next_wanted = now ? idle.now : agenda_.schedule.NextDue(),
      .clients_gone = agenda_.routes.ClientsGone(),
      .is_looked_for = is_looked_for,
      .client_waits = [this](const Member& one) { return agenda_.route_queue.HasFor(one.slave); }};
}

bool Chooser::MayProbe(const Member& member, const Idle& idle) const {
  const Probes::Facts facts = FactsOf(idle);
  return agenda_.probes.NextAt(facts) == idle.now && agenda_.probes.Next(facts) == &member;
}

void Chooser::ChargeProbe(Instant now) {
  const auto began = agenda_.probes.began();
  if (began) agenda_.probes.OnIdle(Waited(*began, now), now);
}

Duration Chooser::Waited(Instant from, Instant to) const {
  if (!agenda_.write_queue.empty() || routed_.AnyMayGo(to)) return to - from;
  const auto due = agenda_.schedule.NextDue();
  if (!due || *due >= to) return Duration::zero();
  return to - std::max(from, *due);
}

bool Chooser::MayRepeat(const Job& job, int more, Instant now) const {
  const Member& member = *job.member;
  const bool looked_for = job.is_probe() && !job.postponed;
  const bool once = looked_for || member.health.state() == DeviceState::never_seen;
  if (job.step.repeats >= (once ? 0 : member.max_retries) + more) return false;
  if (const auto* write = job.goal().As<Job::Write>()) return now < write->command.deadline;
  // It can wait, and a repetition may be as silent.
  const bool waits = job.goal().task.kind == protocols::Task::Kind::background;
  if (waits && more == 0 && !agenda_.background.HasRoom(member.place, now)) return false;
  const bool fails = member.health.failing() || agenda_.schedule.AnotherFails(member.place);
  if (fails && more == 0 && agenda_.schedule.HealthyDue(now)) return false;
  // What must not be repeated is followed by the request that makes it good, or its answer is lost:
  // PollerRoutedOrder.AStartDoesNotMakeADestructiveReadHappenTwice.
  return !(routed_.ShortWriteWaits() && job.step.request.expect.repeatable);
}

bool Chooser::ShortWriteGoesFirst(Instant now) const {
  return agenda_.turns.UrgentAllowed(routed_.ShortWriteWaits()) && routed_.ShortWriteMayGo(now);
}

void Chooser::PutBack(Job& job) {
  agenda_.route_queue.Return(std::move(job.As<Job::Routed>()->batch));
}

}  // namespace baudgate::bus
