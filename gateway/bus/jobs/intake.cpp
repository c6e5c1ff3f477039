// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/intake.h"

#include <algorithm>
#include <utility>

#include "gateway/bus/jobs/job.h"

namespace baudgate::bus {

std::optional<ReportedEvents> EventDelivery::Take(const Device& device, protocols::EventBatch batch,
                                                  const Exchange& exchange) {
  Entry& entry = entries_[device];
  if (batch.drained) entry.drained_at = exchange.asked;
  if (batch.events.empty() && batch.past.empty()) return std::nullopt;
  entry.background = exchange.background;
  ReportedEvents events{device.index, std::move(batch), exchange.answered, {}};
  if (entry.drained_at) events.oldest = exchange.answered.instant - *entry.drained_at;
  return events;
}

Schedule::Brought EventDelivery::OnKept(const Device& device, const std::string& said) {
  Entry& entry = entries_[device];
  const bool repeats = entry.said == said;
  entry.said = said;
  if (std::exchange(entry.background, false)) return Schedule::Brought::something_else;
  return repeats ? Schedule::Brought::no_news : Schedule::Brought::news;
}

namespace {

/// True if the reply makes a point bad that is read only once, so that it must be read again.
/// Example: another meter answers, so all points are bad; the right meter may be back tomorrow.
bool SpoilsOnce(const protocols::Answer& answer, const config::Device& device) {
  return std::ranges::any_of(answer.readings, [&](const protocols::Reading& reading) {
    return reading.point < device.points.size() && !IsGood(reading.quality) &&
           device.points[reading.point].group == config::Group::once;
  });
}

/// Removes readings from `samples` that jumped so far that a second reading must confirm them
/// (JumpCheck), and schedules the second reading. Readings of a write, or of a request that must
/// not be repeated, are not checked.
JumpCheck::Result CheckJumps(const Job& job, Device& device, std::vector<Sample>& samples,
                             ReplyEffects& effects) {
  if (job.task.kind == protocols::Task::Kind::write || !job.step.request.expect.repeatable)
    return {};
  const std::vector<std::uint32_t> points = PointsOf(samples);
  JumpCheck::Result result = device.jumps.Check(samples);
  effects.rechecked = result.ask_again;
  effects.unconfirmed = result.unconfirmed;
  if (!result.ask_again) return result;
  if (job.task.kind == protocols::Task::Kind::poll) {
    effects.read_soon.push_back({device.place, job.task.query});
    return result;
  }
  // A probe has returned these points. The queries that read them are searched in
  // `device.planned_queries`, because the conversation may already have other queries.
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

ReplyEffects Intake::Take(const Job& job, Device& device, protocols::Answer answer, Instant now) {
  ReplyEffects effects;
  effects.peace = answer.wait;
  Store(job, device, answer, now, effects);
  if (answer.batch) Report(job, device, std::move(*answer.batch), effects);
  return effects;
}

/// Writes the readings of a reply to the point store. Their time is the arrival of the reply, minus
/// the time since the oldest try that the reply may answer, and minus the round trip if the reply
/// came after the reply time.
void Intake::Store(const Job& job, Device& device, const protocols::Answer& answer, Instant now,
                   ReplyEffects& effects) {
  const Job::Attempt& attempt = job.attempt;
  const Duration older =
      attempt.verdict.older + (attempt.after_reply_time ? attempt.round_trip : Duration());
  std::vector<Sample> samples = SamplesOf(*device.config, answer.readings);
  if (samples.empty()) return;
  const JumpCheck::Result jumps = CheckJumps(job, device, samples, effects);
  const Now at{attempt.answered_at.instant - older, attempt.answered_at.wall - older};
  store_.Update(device.index, samples, at, attempt.round_trip);
  if (!jumps.doubtful.empty()) store_.Doubt(device.index, jumps.doubtful, now);
  if (SpoilsOnce(answer, *device.config)) effects.repeat.push_back(config::Group::once);
  if (jumps.spoils) effects.repeat.push_back(*jumps.spoils);
  listener_.OnRead(device.index, PointsOf(samples), at);
  if (job.task.kind == protocols::Task::Kind::poll) effects.stored = {device.place, job.points};
}

void Intake::Report(const Job& job, const Device& device, protocols::EventBatch batch,
                    ReplyEffects& effects) {
  const EventDelivery::Exchange exchange{job.attempt.began, job.attempt.answered_at,
                                         job.task.kind == protocols::Task::Kind::background};
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

}  // namespace baudgate::bus
