// What may still be answered although nobody waits for it any more, and who waits instead: the
// line, or the device alone. Numbers are in docs/timeouts.md.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/poll/poller.h"
#include "gateway/poll/poller_parts.h"

namespace baudgate {
namespace {

constexpr int kLongestTrail = 256;  // characters

}  // namespace

void Poller::OnStray(const StrayBytes& stray) {
  const Duration since_end = stray.since_end;
  // A late answer, or the rest of one: this device gets a longer quarantine from now on. What comes
  // too late for any answer is noise, and what follows a damaged one belongs to it.
  const bool noise = last_ == nullptr || since_end > last_->times.ceiling;
  const bool rest = !noise && (last_->babbles || last_->cut_short);
  if (!rest) counters_.stray_bytes += stray.count;
  if (noise || last_->babbles) return;
  Device& device = *last_;
  if (device.late_from && *device.late_from <= now_.instant) {
    CountLate(device, now_.instant - *std::exchange(device.late_from, std::nullopt));
  }
  const Duration needed = std::min(since_end + device.times.gap, device.times.ceiling);
  if (device.answered) {
    // A second copy of the answer, or noise behind it: not longer than an answer can be.
    const Duration longest = device.times.drain + kLongestTrail * device.times.character;
    if (since_end <= longest) device.trail = std::max(device.trail, std::min(needed, longest));
    return;
  }
  if (needed <= device.times.drain + device.late_drain) return;
  if (!std::exchange(device.told_late, true)) {
    const auto after = FormatDuration(std::chrono::round<std::chrono::milliseconds>(since_end));
    listener_.OnWarning(device.index, device.cut_short
                                          ? "the rest of a broken reply came " + after +
                                                " later; if this goes on, raise timing.gap"
                                          : "bytes came " + after +
                                                " after its exchange had ended; if this goes on, "
                                                "raise timing.reply");
  }
  device.late_drain = needed - device.times.drain;
}

/// An unexpected frame may be another device's late answer: then this device's own is still to
/// come. After damage polled devices are found out by their probes; for others what was damaged
/// counts as the answer only where it is as long.
bool Poller::MayStillAnswer(const Work& work, const ExchangeEnd& end) const {
  if (end.outcome == Outcome::no_reply || end.outcome == Outcome::unexpected) return true;
  const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
  if (!damaged || work.device->polled()) return false;
  // Nor may it have been somebody else's.
  const bool others = std::ranges::any_of(everyone_, [&](const Device* device) {
    return device != work.device && device->late_until > work.exchange_began;
  });
  return others || std::ranges::none_of(work.request.expect.shapes, [&](const Shape& shape) {
           return end.received >= shape.min_length && end.received <= shape.max_length;
         });
}

/// Until then its last request has to be answered; later is late.
Instant Poller::AnswerDue(const Work& work) const {
  const LineTimes& times = work.device->times;
  const auto characters = static_cast<std::int64_t>(work.request.bytes.size());
  return work.exchange_began + characters * times.character + times.reply;
}

/// Until then an answer to its last request may come.
Instant Poller::AnswersEnd(const Work& work) const {
  const LineTimes& times = work.device->times;
  const auto characters = static_cast<std::int64_t>(work.request.bytes.size());
  const Instant by_request =
      work.exchange_began + times.quiet + characters * times.character + times.ceiling;
  const Instant by_end = now_.instant + times.ceiling - times.reply;
  return work.device->polled() ? by_end : std::max(by_request, by_end);
}

/// Answers to what an absent device was asked before may come yet: the device alone waits for them,
/// unless its answers are known to be in step.
void Poller::AwaitOlderAnswers() {
  Device& device = *work_->device;
  const bool owed =
      device.unanswered && !work_->routed && device.health.absent() && !device.order->IsInStep();
  SetLate(device, owed ? now_.instant + OlderAnswers(device) : Instant{});
  if (owed) HoldBack(device);
}

/// How long the line waits even behind a good reply. A routed request is sent when no earlier
/// answer can come any more, and never repeated here. An absent device keeps nobody waiting who can
/// be told from it.
Duration Poller::Aftermath(const Work& work) const {
  const Device& device = *work.device;
  const bool named = !work.request.expect.address.empty();
  if (work.routed || (named && device.health.absent())) return device.trail;
  return OlderAnswers(device);
}

/// A reply to the first of several unanswered requests may be taken for one to the last. Those to
/// the requests between come after it, the last as much later as its request was sent later, and
/// more on a device that has been seen to be late by varying times. One that has sent more than its
/// reply before may do so again.
Duration Poller::OlderAnswers(const Device& device) const {
  if (!device.unanswered) return device.trail;
  const Duration since = now_.instant - *device.unanswered + device.times.gap + device.late_drain;
  return std::min(std::max(since, device.trail), device.times.ceiling);
}

/// When the request of `work` may be sent: no earlier than the last moment at which an answer to
/// another request could come that would pass for its own. A retry may be met by the answer to its
/// first try; a reply that carries its sender's address is not taken for another device's.
Instant Poller::ClearAt(const Work& work) const {
  if (work.attempts > 0) return {};
  Instant clear{};
  for (const Device* device : everyone_) {
    const bool alike = device->IsSame(*work.device) || work.request.expect.address.empty();
    if (alike) clear = std::max(clear, device->late_until);
  }
  return clear;
}

/// Entries of one address are one device on the wire.
void Poller::Recognise(Device& device, const Bytes& sender) {
  if (!device.sender.empty() || sender.empty()) return;
  device.sender = sender;
  for (Device* other : everyone_) {
    if (other == &device || !device.IsSame(*other)) continue;
    device.order = other->order;
    device.probe_index = other->probe_index;
    return;
  }
}

void Poller::SetLate(const Device& device, Instant until) {
  for (Device* one : everyone_) {
    if (one->IsSame(device)) one->late_until = until;
  }
}

/// No request of its own may be met by what is still under way.
void Poller::HoldBack(const Device& device) {
  for (const Device* one : everyone_) {
    if (one->IsSame(device) && one->polled()) schedule_.Hold(one->slot, device.late_until);
  }
}

}  // namespace baudgate
