// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/unasked.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/bus/jobs/intake.h"

namespace baudgate::bus {

const protocols::Standing* Speaker::standing() const {
  return device_ == nullptr ? nullptr : device_->conversation->Listens();
}

Speaker::Said Speaker::OnMessage(const UnaskedMessage& message, Now now) {
  const Now received{now.instant - message.since, now.wall - message.since};
  const Instant before = std::exchange(last_, received.instant);
  rest_ = before == Instant() ? kLongIdle : received.instant - before;
  return Take(device_->conversation->OnUnasked(message.bytes, received), received);
}

std::optional<Instant> Speaker::DueAt() const {
  return in_use() ? device_->conversation->DueAt() : std::nullopt;
}

std::optional<Speaker::Said> Speaker::OnTimer(Now now) {
  const auto due = DueAt();
  if (!due || *due > now.instant) return std::nullopt;
  return Take(device_->conversation->OnDue(now), now);
}

Speaker::Said Speaker::Take(protocols::Answer answer, Now received) {
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

void Speaker::Keep(protocols::EventBatch batch, Said& said) {
  const std::size_t events = batch.events.size();
  if (!backlog_.Take(events)) {
    said.lost = events;
    if (std::exchange(told_lost_, true)) return;
    said.warning = fmt::format(
        "{} of its events wait for the disk, and further events are lost until the disk stores "
        "these; check the disk (dmesg)",
        EventBacklog::kMost);
    return;
  }
  if (const std::size_t lost = backlog_.TakeLost(); lost > 0) {
    told_lost_ = false;
    const std::string text =
        "lost before this event, because the disk failed: " + Plural(lost, "event");
    batch.events.insert(batch.events.begin(), protocols::DeviceEvent{.text = text});
  }
  said.events = {device_->index, std::move(batch), said.received, {}};
}

void UnaskedSide::OnOpened() {
  first_ = true;
  if (const Device* const device = speaker_.device()) {
    accounts_.states.OnState(*device, "the port is open");
  }
}

void UnaskedSide::OnKept(const Device& device) {
  if (&device == speaker_.device()) speaker_.OnKept();
}

void UnaskedSide::OnSettled(Instant now) {
  if (speaker_.drained()) intake_.OnDrained(*speaker_.device(), now);
}

void UnaskedSide::Overhear(View bytes, Instant now) {
  // The first bytes show whether the serial server negotiates (Telnet). At other times
  // LineObserver::TakeNegotiation reports the negotiation at the end of an exchange.
  const bool begins = std::exchange(first_, false) && speaker_.in_use();
  if (begins && is_network_ && observer_.IsNegotiation(bytes)) {
    accounts_.line.OnNegotiation();
    tracker_.ShowLine(now);
  }
  if (speaker_.in_use()) observer_.OnUnaskedBytes(bytes, now);
}

void UnaskedSide::OnInput(const UnaskedInput& heard, Now now) {
  if (!speaker_.in_use()) return;
  Device& device = *speaker_.device();
  for (std::size_t i = 0; i < heard.damaged; ++i) {
    const std::string why(heard.why);
    tracker_.OnUnasked(device, Outcome::corrupt, why, now.instant);
    observer_.OnUnasked(device, Outcome::corrupt, why, {}, {}, now.instant);
  }
  for (const UnaskedMessage& message : heard.messages) {
    Speaker::Said said = speaker_.OnMessage(message, now);
    tracker_.OnUnasked(device, said.outcome, said.reason, now.instant);
    observer_.OnUnasked(device, said.outcome, said.reason, said.remedy, speaker_.rest(),
                        now.instant);
    Take(std::move(said), now.instant);
  }
}

void UnaskedSide::OnTimer(Now now) {
  if (auto said = speaker_.OnTimer(now)) Take(std::move(*said), now.instant);
}

void UnaskedSide::Take(Speaker::Said said, Instant now) {
  Device& device = *speaker_.device();
  tracker_.OnHeard(device, now);
  if (said.lost > 0) accounts_.devices.OnLostEvents(device, said.lost);
  intake_.TakeUnasked(device, std::move(said));
}

}  // namespace baudgate::bus
