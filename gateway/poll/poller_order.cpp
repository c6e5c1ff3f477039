// To which request a reply belongs, as far as anybody can know: fingerprints and identities for
// gateway/poll/answer_order.h, the probe that goes first where a reply might be an earlier one's,
// and what becomes of readings when it was.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <string_view>
#include <utility>

#include "gateway/poll/poller.h"
#include "gateway/poll/poller_parts.h"

namespace baudgate {
namespace {

/// A device that has been replaced by one of another kind is believed after so many probes: more
/// than replies to earlier requests may still be on their way.
constexpr int kProbesOfAnother = 16;

/// So many answered probes of another kind, and none to the identification, end it.
constexpr int kOtherProbes = 3;

/// A line feed behind the carriage return may be missing, or come with the next bytes.
View WithoutLineEnd(View frame) {
  while (!frame.empty() && (frame.back() == '\r' || frame.back() == '\n')) {
    frame = frame.first(frame.size() - 1);
  }
  return frame;
}

}  // namespace

/// A reply that carries its sender's address is none of those that a serial server owes to others.
bool Poller::MayBeInStep(const Work& work) const {
  const bool anonymous = work.request.expect.address.empty();
  return work.device->order->MayBeInStep() && (!anonymous || order_.MayBeInStep());
}

bool Poller::IsSafe(const Work& work) const {
  const AnswerOrder::Fingerprint fingerprint = FingerprintOf(work.request);
  const bool anonymous = work.request.expect.address.empty();
  return work.device->order->IsSafe(fingerprint) && (!anonymous || order_.IsSafe(fingerprint));
}

AnswerOrder::Fingerprint Poller::ProbeOf(const Device& device) const {
  return device.identity.empty() ? AnswerOrder::kNamelessProbe
                                 : AnswerOrder::Probe(device.probe_index);
}

AnswerOrder::Fingerprint Poller::FingerprintOf(const Request& request) const {
  const Device& device = *work_->device;
  const bool probe = device.identity.empty() ? work_->task.kind == Task::Kind::probe
                                             : request.bytes == device.identify;
  if (probe) return ProbeOf(device);
  return std::hash<std::string_view>{}(AsText(request.bytes)) << 1U;
}

/// An identification is the same frame every time and no answer to anything else. Where the
/// protocol has none, the form of an answer tells a probe from other requests.
bool Poller::LooksLikeProbe(View whole) {
  const View frame = WithoutLineEnd(whole);
  Device& device = *work_->device;
  const Answer& answer = work_->answer;
  const bool certain = device.order->IsInStep() && order_.IsInStep();
  if (device.identity.empty() && certain && work_->request.steady &&
      answer.outcome == Outcome::ok) {
    device.identify = work_->request.bytes;
    device.identity.assign(frame.begin(), frame.end());
  }
  ForgetSilentIdentity(device, answer.outcome);
  if (device.identity.empty()) {
    const bool asked = work_->task.kind == Task::Kind::probe;
    return asked == ProvesLife(answer.outcome);
  }
  const bool is_identity = std::ranges::equal(frame, device.identity);
  if (work_->request.bytes != device.identify) return is_identity;
  if (!is_identity && !ProvesLife(answer.outcome)) {
    device.other_seen = 0;  // no identification at all: the order is wrong, not the device
    return false;
  }
  const bool ok = answer.outcome == Outcome::ok;
  const bool another = ok && !std::ranges::equal(frame, device.other_identity);
  if (is_identity || another) device.other_seen = 0;
  if (is_identity) return true;
  if (ok) device.other_identity.assign(frame.begin(), frame.end());
  if (++device.other_seen < kProbesOfAnother) return false;
  // It has been replaced, or does not identify itself any more.
  device.identity = ok ? device.other_identity : Bytes();
  if (!ok) device.identify.clear();
  device.other_seen = 0;
  return true;
}

/// A device that answers other probes, and not the one that it identified itself to, is another
/// now. What may be replies to earlier requests says nothing about that.
void Poller::ForgetSilentIdentity(Device& device, Outcome outcome) {
  if (work_->task.kind != Task::Kind::probe || !ProvesLife(outcome)) return;
  if (!MayBeInStep(*work_)) return;
  device.other_probes = work_->request.bytes == device.identify ? 0 : device.other_probes + 1;
  if (device.other_probes < kOtherProbes) return;
  device.identify.clear();
  device.identity.clear();
}

/// The first request of a task to a device of which it is not known what it answers.
bool Poller::NeedsSync() const {
  const Device& device = *work_->device;
  if (!device.polled() || !device.in_use) return false;
  const bool first = work_->steps == 1 && work_->attempts == 0;
  const bool answered = work_->request.expect.reply == Expectation::Reply::one;
  if (!first || !answered || work_->task.kind == Task::Kind::probe) return false;
  return !device.acquainted || !MayBeInStep(*work_) || !IsSafe(*work_);
}

void Poller::Synchronize() {
  postponed_ = std::move(work_);
  BeginTask(*postponed_->device, {Task::Kind::probe, 0, kNoPoint, {}});
  Ask();
}

/// What the probe came to is never the outcome of the task that waited for it.
void Poller::ResumePostponed(Outcome outcome, const std::string& reason) {
  work_ = std::move(postponed_);
  const Device& device = *work_->device;
  // A device that wants to be left in peace gets it: a meter counts wrong passwords.
  const bool in_peace = schedule_.held_until(device.slot) > now_.instant;
  const bool allowed = !in_peace || (work_->command && outcome == Outcome::ok);
  if (ProvesLife(outcome) && device.in_use && MayBeInStep(*work_) && allowed) {
    if (work_->routed) return;  // its request is as it was
    work_->steps = 0;
    Ask();
    return;
  }
  work_->mute = true;
  if (!device.in_use) return FinishTask(Outcome::no_reply, "the device is disabled");
  FinishTask(outcome == Outcome::ok ? Outcome::busy : outcome, reason);
}

void Poller::OnSecondReply() {
  if (last_ == nullptr) return;
  ChangeStatus(*last_, [](DeviceStatus& status) { ++status.doubled; });
  if (!std::exchange(last_->told_second, true)) {
    listener_.OnWarning(last_->index,
                        "a second, different reply came behind one: replies come twice, or one "
                        "request late; what was read just before is read again");
  }
  last_->order->OnSilence();
  order_.OnSilence();
  DoubtReadings();
}

/// One of the latest replies belonged to another request, nobody knows which.
void Poller::DoubtReadings() {
  for (const QueryRef& read : std::exchange(unproven_, {})) {
    Device& device = *devices_[read.device];
    const auto queries = device.conversation->Queries();
    if (!device.in_use || read.query >= queries.size()) continue;
    store_.Doubt(device.index, queries[read.query].points, now_.instant);
    writes_.AddReadBack(read);
  }
}

}  // namespace baudgate
