// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/speaker.h"

#include <fmt/format.h>

#include <utility>

#include "gateway/base/shown.h"
#include "gateway/bus/devices/samples.h"

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

}  // namespace baudgate
