// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/effect_applier.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "gateway/bus/jobs/job_end.h"

namespace baudgate {

namespace {

/// A point that is read once is bad. Example: another meter answers, so that all points of this one
/// are; the right one may be back tomorrow.
bool SpoilsOnce(const Answer& answer, const config::Device& device) {
  return std::ranges::any_of(answer.readings, [&](const Reading& reading) {
    return reading.point < device.points.size() && !IsGood(reading.quality) &&
           device.points[reading.point].group == config::Group::once;
  });
}

/// Takes readings that do not count yet out of `samples`. A reading that must not be asked for
/// twice counts as it comes. A probe that reads a point is no better proof of it than a poll.
JumpCheck::Result CheckJumps(const Job& job, Device& device, std::vector<Sample>& samples,
                             ReplyEffects& effects) {
  if (job.task.kind == Task::Kind::write || !job.step.request.expect.repeatable) return {};
  const std::vector<std::uint32_t> points = PointsOf(samples);
  JumpCheck::Result result = device.jumps.Check(samples);
  effects.rechecked = result.ask_again;
  effects.unconfirmed = result.unconfirmed;
  if (!result.ask_again) return result;
  if (job.task.kind == Task::Kind::poll) {
    effects.read_soon.push_back({device.place, job.task.query});
    return result;
  }
  // Its conversation may have another plan by now; read-backs are counted by the present one.
  const auto& queries = device.planned_queries;
  for (const std::uint32_t point : points) {
    for (std::size_t query = 0; query < queries.size(); ++query) {
      const auto& its = queries[query].points;
      if (std::ranges::find(its, point) == its.end()) continue;
      effects.read_soon.push_back({device.place, query});
    }
  }
  return result;
}

}  // namespace

ReplyEffects Intake::Take(const Job& job, Device& device, Answer answer, Instant now) {
  ReplyEffects effects;
  effects.peace = answer.wait;
  Store(job, device, answer, now, effects);
  if (answer.batch) Report(job, device, std::move(*answer.batch), effects);
  return effects;
}

/// A reply that may answer an earlier try of the same request is as old as that try; a late one is
/// as old as its request.
void Intake::Store(const Job& job, Device& device, const Answer& answer, Instant now,
                   ReplyEffects& effects) {
  const Job::Attempt& attempt = job.attempt;
  const Duration older =
      attempt.verdict.older + (attempt.after_reply_time ? attempt.round_trip : Duration());
  std::vector<Sample> samples = SamplesOf(*device.config, answer.readings);
  if (samples.empty()) return;
  const JumpCheck::Result jumps = CheckJumps(job, device, samples, effects);
  const Now at{attempt.answered_at.instant - older, attempt.answered_at.wall - older};
  store_.Update(device.index, samples, at, attempt.round_trip);
  store_.Doubt(device.index, jumps.doubtful, now);
  if (SpoilsOnce(answer, *device.config)) effects.repeat.push_back(config::Group::once);
  if (jumps.spoils) effects.repeat.push_back(*jumps.spoils);
  listener_.OnRead(device.index, PointsOf(samples), at);
  if (job.task.kind == Task::Kind::poll) effects.stored = {device.place, job.points};
}

void Intake::Report(const Job& job, const Device& device, EventBatch batch, ReplyEffects& effects) {
  const EventDelivery::Exchange exchange{job.attempt.began, job.attempt.answered_at,
                                         job.task.kind == Task::Kind::background};
  const bool drained = batch.drained;
  std::optional<ReportedEvents> events = delivery_.Take(device, std::move(batch), exchange);
  if (!events) {
    if (drained) OnDrained(device, exchange.asked);
    return;
  }
  effects.hold_events = true;
  listener_.OnEvents(std::move(*events));
}

void Intake::TakeUnasked(const Device& device, Speaker::Said said) {
  if (!said.samples.empty()) {
    store_.Update(device.index, said.samples, said.received, {});
    listener_.OnRead(device.index, PointsOf(said.samples), said.received);
  }
  if (!said.warning.empty()) listener_.OnWarning(device.index, said.warning);
  if (said.events) listener_.OnEvents(std::move(*said.events));
}

void EffectApplier::ApplyReply(const Job& job, Device& device, Answer answer, Instant now) {
  const ReplyEffects effects = intake_.Take(job, device, std::move(answer), now);
  if (effects.rechecked) accounts_.devices.OnRecheck(device);
  if (effects.unconfirmed) accounts_.devices.OnUnconfirmed(device);
  for (const QueryRef& query : effects.read_soon) agenda_.write_queue.AddReadBack(query);
  for (const config::Group group : effects.repeat) tracker_.Repeat(device, group, false, now);
  if (effects.stored) owed_.readings.OnStored(*effects.stored);
  if (effects.hold_events) {
    agenda_.schedule.HoldEvents(device.place);
    agenda_.background.AwaitDisk(device.place);
  }
  if (effects.peace > Duration::zero()) agenda_.schedule.Hold(device.place, now + effects.peace);
}

void EffectApplier::OnEventsKept(const Device& device, const std::string& said, Instant now) {
  agenda_.schedule.ReleaseEvents(device.place, device.conversation->HasEvents(),
                                 intake_.OnKept(device, said), now);
  agenda_.background.Release(device.place);
  tracker_.PlanBackground(device);
}

std::optional<Job::Write> EffectApplier::ApplyEnd(Job& done, EndEffects effects, const JobEnd& end,
                                                  Instant now) {
  Member& member = *done.member;
  Device* const device = member.device;
  if (const auto& background = effects.background; background && background->sent) {
    agenda_.background.NoteEnd(member.place, background->took, background->proved);
  } else if (background) {
    agenda_.background.OnUnsent(member.place);
  }
  if (device != nullptr) tracker_.PlanBackground(*device);
  if (done.probe_budget) agenda_.probes.NoteEnd(member, *done.probe_budget, done.began);
  if (effects.fast_poll) accounts_.rounds.OnPoll(member, *effects.fast_poll, now);
  if (effects.poll) {
    const auto& [query, answered] = *effects.poll;
    accounts_.devices.OnPoll(*device, query, answered, done.had_failure);
  }
  if (effects.repeat) {
    tracker_.Repeat(*device, effects.repeat->group, effects.repeat->soon, now);
  }
  if (!effects.read_again.empty()) tracker_.ReadBack(*device, effects.read_again);
  if (!effects.doubt.empty() && member.in_use) tracker_.Doubt(*device, effects.doubt, now);
  if (effects.polls_first && device != nullptr) agenda_.schedule.GoFirst(member.place);
  // Silence to a query that was never answered says something about the query, not about the
  // device.
  if (effects.judges_member && !done.blames_query)
    tracker_.OnTask(member, end.outcome, end.reason, now);
  if (effects.wrote) {
    std::span<const PointWrite> writes;
    if (const auto* const write = done.As<Job::Write>()) {
      writes = std::span(write->command.writes()).subspan(write->first, write->next - write->first);
    }
    tracker_.OnWritten(*member.protocol, done.step.request.bytes, device, writes,
                       ProvesLife(end.outcome), now);
  }
  for (auto& [request, reply] : effects.replies) request.done(std::move(reply));
  if (!effects.write) return std::nullopt;
  return OnWriteEnd(*done.As<Job::Write>(), *device, *effects.write, now);
}

std::optional<Job::Write> EffectApplier::OnWriteEnd(Job::Write& write, Device& device,
                                                    const EndEffects::Write& effects, Instant now) {
  using Next = EndEffects::Write::Next;
  tracker_.Doubt(device, effects.unknown, now);
  for (const PointWrite& one : effects.confirmed) device.jumps.OnWritten(one.point, one.shown);
  if (!effects.confirmed.empty()) write.command.MoveTo(WriteState::reading_back);
  switch (effects.next) {
    case Next::answer:
      accounts_.devices.OnWrite(device, effects.result.end, false);
      write.command.End(effects.result);
      break;
    case Next::confirm:
      agenda_.write_queue.Confirm(std::move(write.command), device.place, now);
      break;
    case Next::go_on:
      write.command.MoveTo(WriteState::queued);
      return std::move(write);
  }
  return std::nullopt;
}

}  // namespace baudgate
