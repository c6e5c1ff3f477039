// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/intake.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/bus/devices/arrivals.h"

namespace baudgate {

Speaker::Speaker(const Roster& roster, LineObserver& observer)
    : device_(roster.Speaker()), observer_(observer) {}

std::optional<Finding> Speaker::Hear(View bytes, Instant now) {
  return in_use() ? observer_.OnUnaskedBytes(bytes, now) : std::nullopt;
}

const Standing* Speaker::standing() const {
  return device_ == nullptr ? nullptr : device_->conversation->Listens();
}

Speaker::Said Speaker::OnMessage(const UnaskedMessage& message, Now now) {
  const Now received{now.instant - message.since, now.wall - message.since};
  const Instant before = std::exchange(last_, received.instant);
  rest_ = before == Instant() ? kLongIdle : received.instant - before;
  return Take(device_->conversation->OnUnasked(message.bytes, received), received);
}

Finding Speaker::Look(const Said& said) {
  if (!ProvesLife(said.outcome)) return observer_.OnUnaskedDamage();
  observer_.OnUnaskedRead();
  if (said.reason.empty()) return {.idle = rest_};
  return {.symptom = Symptom::refusal, .idle = rest_, .cause = said.reason, .remedy = said.remedy};
}

std::optional<Instant> Speaker::DueAt() const {
  return in_use() ? device_->conversation->DueAt() : std::nullopt;
}

std::optional<Speaker::Said> Speaker::OnTimer(Now now) {
  const auto due = DueAt();
  if (!due || *due > now.instant) return std::nullopt;
  return Take(device_->conversation->OnDue(now), now);
}

Speaker::Said Speaker::Take(Answer answer, Now received) {
  Said said{.outcome = answer.outcome,
            .reason = std::move(answer.reason),
            .remedy = std::move(answer.remedy),
            .received = received,
            .samples = SamplesOf(*device_->config, answer.readings),
            .events = {},
            .lost = 0,
            .warning = {}};
  if (answer.batch && !answer.batch->events.empty()) Keep(std::move(*answer.batch), said);
  return said;
}

void Speaker::Keep(EventBatch batch, Said& said) {
  const std::size_t events = batch.events.size();
  if (!backlog_.Take(events)) {
    said.lost = events;
    if (std::exchange(told_lost_, true)) return;
    said.warning = fmt::format(
        "{} of its events wait for the disk: further ones are lost and counted until some are kept",
        EventBacklog::kMost);
    return;
  }
  if (const std::size_t lost = backlog_.TakeLost(); lost > 0) {
    told_lost_ = false;
    const std::string text = Plural(lost, "event") + " before this one lost: the disk failed";
    batch.events.insert(batch.events.begin(), DeviceEvent{.text = text});
  }
  said.events = {device_->index, std::move(batch), said.received, {}};
}

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

}  // namespace baudgate
