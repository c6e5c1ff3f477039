// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/conversation.h"

#include <algorithm>

#include "protocols/set4tm/codec.h"
#include "protocols/set4tm/conversation_steps.h"
#include "protocols/set4tm/snapshot.h"

namespace baudgate::protocols::set4tm {
namespace {

/// Reference, chapter 4: the multiplier stretches the silence that ends a frame, and the answer
/// with it: no later than 100 ms behind it.
config::Timing StretchedTimes(int multiplier, Duration character) {
  constexpr Duration kWithin = 100ms;
  constexpr Duration kMargin = 200ms;
  const Duration silence = multiplier * std::max<Duration>(4ms, 7 * character);
  config::Timing timing;
  timing.quiet = silence;
  timing.reply = 2 * silence + multiplier * kWithin + kMargin;
  return timing;
}

}  // namespace

MeterConversation::MeterConversation(const config::Device& device, const Settings& settings,
                                     MeterBus& bus)
    : parts_(device, settings, bus),
      reader_(parts_.settings, parts_.reads.fields(), parts_.identification),
      requests_(parts_),
      replies_(parts_) {
  OnReconnect();
}

void MeterConversation::OnReconnect() {
  parts_.refused.Forget();
  parts_.identification.OnReconnect();
  parts_.drift.Forget();
  parts_.latched.OnReconnect();
  parts_.archive.OnReconnect();
  parts_.session.OnReconnect();
  parts_.reads.OnReconnect();
}

bool MeterConversation::ForgetRefusals() {
  parts_.ForgetRefusals(true);
  return parts_.reads.ForgetRefusals();
}

std::optional<Instant> MeterConversation::BackgroundDue() const {
  const auto job = parts_.archive.due();
  const auto latch = parts_.latched.DueAt();
  return job && latch ? std::min(*job, *latch) : job ? job : latch;
}

void MeterConversation::Stamp(Request& request, Now arrives, Duration character) {
  const auto asked = SplitFrame(request.bytes, parts_.settings.checksum);
  if (AsksClock(asked->body)) {
    parts_.drift.OnSent(arrives, character);
  } else {
    parts_.latched.OnClock(arrives);
  }
}

Then MeterConversation::OnSent(const Task& /*task*/, const Request& /*request*/, Instant /*now*/) {
  parts_.latched.OnSent();
  return Then::ask_again;
}

// ---------------------------------------------------------------- what comes

Answer MeterConversation::OnFrame(const Task& task, const Request& request, View frame,
                                  Instant now) {
  Reply reply = reader_.Read(request.bytes, frame);
  const bool fits = !reply.pdu.empty();
  Answer answer = fits
                      ? replies_.Take({requests_.kind(), task, std::move(reply), frame.size(), now})
                      : std::move(reply.answer);
  if (answer.then != Then::ask_again) parts_.session.OnTaskEnd();
  return answer;
}

/// `request` need not be the latest: one that waits behind a probe may fail without having been
/// sent.
Then MeterConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                  Instant now) {
  const auto parts = SplitFrame(request.bytes, parts_.settings.checksum);
  const View pdu = parts ? parts->body : View();
  const bool opens = !pdu.empty() && pdu[0] == kOpenChannel;
  const bool was_sent = outcome != Outcome::busy;
  if (task.kind == Task::Kind::events && IsJournal(pdu)) parts_.archive.OnNoRecord(outcome, now);
  if (was_sent) parts_.latched.OnFailure(pdu);
  const bool of_latch = Is(pdu, AskLatchTime());
  if (task.kind == Task::Kind::background && !of_latch) parts_.archive.OnFailure(now);
  parts_.session.OnFailure(opens, outcome, now);
  if (was_sent && requests_.kind() == RequestKind::trial && IsMasked(pdu)) {
    // Some are silent to what they do not know. It is asked as others are, and by that is there.
    parts_.reads.EndTrial();
    return Then::ask_again;
  }
  parts_.identification.OnLost();
  return Then::done;
}

Answer MeterConversation::Interpret(View request, View frame) {
  Reply reply = reader_.Read(request, frame);
  if (!reply.data.empty()) parts_.identification.Learn(reply.pdu, reply.data);
  return std::move(reply.answer);
}

// ---------------------------------------------------------------- what is learned

config::Timing MeterConversation::LeastTimes(Duration character) const {
  const auto multiplier = static_cast<int>(parts_.identification.multiplier());
  if (multiplier == 1) return {};
  return StretchedTimes(multiplier, character);
}

std::string MeterConversation::WhatIsLearned() const {
  const unsigned multiplier = parts_.identification.multiplier();
  return Listed({parts_.reads.Learned(), parts_.archive.Learned(), parts_.latched.Learned(),
                 multiplier > 1 ? "times by its multiplier " + std::to_string(multiplier) : ""});
}

}  // namespace baudgate::protocols::set4tm
