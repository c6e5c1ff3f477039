// What a device says by itself, from its line to the store and the events. Requests and replies are
// in job_run.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <utility>

#include "gateway/base/shown.h"
#include "gateway/poll/poller.h"
#include "gateway/store/conversion.h"

namespace baudgate {

void Poller::ListenToDevices() {
  for (const auto& device : roster_.devices()) {
    const Standing* standing = device->conversation->Listens();
    if (standing == nullptr) continue;
    line_.Listen(*standing);
    speaker_ = device.get();
    ledger_.OnSpeaks(*device);
    return;
  }
}

void Poller::OnUnasked(const Heard& heard) {
  if (speaker_ == nullptr || !speaker_->in_use) return;
  for (std::size_t i = 0; i < heard.damaged; ++i) {
    OnUnasked(Outcome::corrupt, std::string(heard.why));
  }
  for (const UnaskedMessage& message : heard.messages) {
    const Now received{now_.instant - message.since, now_.wall - message.since};
    const Answer answer = speaker_->conversation->OnUnasked(message.bytes, received);
    OnUnasked(answer.outcome, answer.reason);
    TakeUnasked(answer, received);
  }
}

void Poller::OnUnasked(Outcome outcome, const std::string& reason) {
  Device& device = *speaker_;
  device.health.OnExchange(outcome);
  ledger_.OnUnasked(device, outcome, reason);
  if (ProvesLife(outcome)) {
    upkeep_.OnTask(device, Outcome::ok, {}, now_.instant);
  } else {
    ledger_.OnState(device, reason);
  }
}

void Poller::SpeakerDue() {
  if (speaker_ == nullptr || !open_ || !speaker_->in_use) return;
  const auto due = speaker_->conversation->DueAt();
  if (due && *due <= now_.instant) TakeUnasked(speaker_->conversation->OnDue(now_), now_);
}

void Poller::TakeUnasked(const Answer& answer, Now received) {
  Device& device = *speaker_;
  upkeep_.OnHeard(device, now_.instant);
  std::vector<Sample> samples;
  std::vector<std::uint32_t> points;
  for (const Reading& reading : answer.readings) {
    if (reading.point >= device.config->points.size()) continue;
    samples.push_back(ToSample(device.config->points[reading.point], reading));
    points.push_back(samples.back().point);
  }
  if (!samples.empty()) {
    store_.Update(device.index, samples, received, {});
    listener_.OnRead(device.index, points, received);
  }
  if (answer.batch && !answer.batch->events.empty()) KeepUnasked(*answer.batch, received);
}

void Poller::KeepUnasked(EventBatch batch, Now received) {
  Device& device = *speaker_;
  const std::size_t events = batch.events.size();
  if (!unkept_.Take(events)) {
    ledger_.OnLostEvents(device, events);
    if (!std::exchange(told_lost_, true)) {
      listener_.OnWarning(device.index,
                          fmt::format("{} of its events wait for the disk: what it says from now "
                                      "on is lost and counted, until some are kept",
                                      Unkept::kMost));
    }
    return;
  }
  if (const std::size_t lost = unkept_.TakeLost(); lost > 0) {
    told_lost_ = false;
    const std::string text = Plural(lost, "event") + " before this one lost: the disk failed";
    batch.events.insert(batch.events.begin(), DeviceEvent{.text = text});
  }
  listener_.OnEvents({device.index, std::move(batch), received, {}});
}

/// What it says is told at once: when all of that is kept there is no more.
void Poller::TellDrained() {
  if (speaker_ != nullptr && unkept_.waiting() == 0) {
    listener_.OnDrained(speaker_->index, now_.instant);
  }
}

}  // namespace baudgate
