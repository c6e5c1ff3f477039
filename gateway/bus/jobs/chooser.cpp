// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/chooser.h"

#include <algorithm>
#include <utility>

#include "gateway/bus/jobs/background.h"
#include "gateway/bus/jobs/line_context.h"
#include "gateway/bus/jobs/poll.h"
#include "gateway/bus/jobs/probe.h"
#include "gateway/bus/jobs/read_back.h"
#include "gateway/bus/jobs/routed.h"
#include "gateway/bus/jobs/write.h"

namespace baudgate::bus {

namespace {

class ParkedSource final : public JobSource {
 public:
  explicit ParkedSource(ParkedJobs& parked) : parked_(parked) {}

  std::unique_ptr<Job> Take(const Idle& idle) override { return parked_.Take(idle.now); }
  std::optional<Instant> NextAt(const Idle& /*idle*/) const override { return parked_.NextAt(); }

 private:
  ParkedJobs& parked_;
};

}  // namespace

/// Creates the sources of jobs. Sources with the same turn are asked in the order of these lines.
/// The read-back of a written value goes before further writes, because the client of the first
/// write still waits.
Chooser::Chooser(LineContext& line) : line_(line) {
  using Turn = Turns::Choice;
  const auto add = [this](std::optional<Turn> turn, auto source) {
    sources_.push_back({turn, std::make_unique<decltype(source)>(std::move(source))});
  };
  add(Turn::urgent, ShortWriteSource(line));
  add(Turn::urgent, ReadBackSource(line));
  add(Turn::urgent, WriteSource(line));
  add(Turn::parked, ParkedSource(line.agenda.parked));
  add(Turn::probe, ProbeSource(line));
  add(Turn::poll, BackgroundSource(line, Background::Which::that_starves));
  add(Turn::poll, PollSource(line));
  add(Turn::routed_high, RoutedSource(line.routed, config::Priority::high));
  add(Turn::routed_normal, RoutedSource(line.routed, config::Priority::normal));
  add(Turn::routed_low, RoutedSource(line.routed, config::Priority::low));
  add(std::nullopt, BackgroundSource(line, Background::Which::that_fits));
}

std::unique_ptr<Job> Chooser::Next(const Idle& idle) {
  const auto take = [&](std::optional<Turns::Choice> turn) -> std::unique_ptr<Job> {
    for (const Source& source : sources_) {
      if (source.turn != turn) continue;
      if (auto job = source.jobs->Take(idle)) return job;
    }
    return nullptr;
  };
  const Turns::Waiting waiting = line_.routed.Waiting();
  for (const Turns::Choice turn : line_.agenda.turns.Order(waiting)) {
    auto job = take(turn);
    if (!job) continue;
    line_.agenda.turns.OnTaken(turn, waiting);
    return job;
  }
  line_.agenda.turns.OnNothing();
  return take(std::nullopt);
}

std::optional<Instant> Chooser::NextAt(const Idle& idle) const {
  std::optional<Instant> soonest;
  for (const Source& source : sources_) soonest = Soonest({soonest, source.jobs->NextAt(idle)});
  return soonest;
}

void Chooser::OnTime(Duration passed, const Member* busy_with) {
  const bool failing = busy_with != nullptr && busy_with->device != nullptr &&
                       line_.agenda.schedule.failing(busy_with->place);
  line_.agenda.turns.OnTime(passed, failing);
}

bool Chooser::MayRepeat(const Job& job, int more, Instant now) const {
  const Member& member = *job.member;
  const Schedule& schedule = line_.agenda.schedule;
  // A retry of a background read must not delay the next poll, because the read is not urgent.
  const bool waits = job.goal().task.kind == protocols::Task::Kind::background;
  if (waits && more == 0 && !line_.agenda.background.HasRoom(member.place, now)) return false;
  const bool fails = member.health.failing() || schedule.AnotherFails(member.place);
  if (fails && more == 0 && schedule.HealthyDue(now)) return false;
  // A request with a reply that the device gives only once is retried at once, even if a write
  // waits: the request that fetches the lost reply must come next, or the reply is lost. See
  // PollerRoutedOrder.AStartDoesNotMakeADestructiveReadHappenTwice.
  return !(line_.routed.ShortWriteWaits() && job.step.request.expect.repeatable);
}

Probes::Facts Chooser::FactsOf(const Idle& idle) const {
  const RoutedJobs& routed = line_.routed;
  const Agenda& agenda = line_.agenda;
  const bool now = agenda.routes.ClientsAreHere(idle.now) || routed.AnyMayGo(idle.now);
  return {.now = idle.now,
          .idle_since = idle.since,
          .next_wanted = now ? idle.now : agenda.schedule.NextDue(),
          .clients_gone = agenda.routes.ClientsGone(),
          .is_looked_for =
              [&routed, idle](const Member& one) {
                return (one.device != nullptr && one.in_use) || routed.IsLookedFor(one, idle);
              },
          .client_waits =
              [&agenda](const Member& one) { return agenda.route_queue.HasFor(one.slave); }};
}

bool Chooser::MayProbe(const Member& member, const Idle& idle) const {
  const Probes::Facts facts = FactsOf(idle);
  const Probes& probes = line_.agenda.probes;
  return probes.NextAt(facts) == idle.now && probes.Next(facts) == &member;
}

void Chooser::ChargeProbe(Instant now) {
  Probes& probes = line_.agenda.probes;
  if (const auto began = probes.began()) probes.OnIdle(Waited(*began, now), now);
}

Duration Chooser::Waited(Instant from, Instant to) const {
  if (!line_.agenda.write_queue.empty() || line_.routed.AnyMayGo(to)) return to - from;
  const auto due = line_.agenda.schedule.NextDue();
  if (!due || *due >= to) return Duration::zero();
  return to - std::max(from, *due);
}

bool Chooser::ShortWriteGoesFirst(Instant now) const {
  return line_.agenda.turns.UrgentAllowed(line_.routed.ShortWriteWaits()) &&
         line_.routed.ShortWriteMayGo(now);
}

}  // namespace baudgate::bus
