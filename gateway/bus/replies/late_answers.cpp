// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/replies/late_answers.h"

#include <algorithm>
#include <utility>

namespace baudgate {

namespace {

constexpr int kAgain = 2;
/// After this many replies in time, a late one counts as the first again.
constexpr int kRepliesToForget = 100;
/// Each reply in time takes off this part.
constexpr int kPartTakenOff = 1024;
constexpr Duration kLeastPatience = 1ms;

/// How much longer than the reply time and the gap the line may wait before it reaches the ceiling.
Duration RoomOf(const Member& member) {
  const LineTimes& times = member.times;
  return std::max<Duration>(times.ceiling - times.reply - times.gap, {});
}

}  // namespace

void Patience::Lengthen(State& state, Duration lateness) {
  state.more = std::max(state.more, lateness + lateness / 4);
}

void Patience::OnLate(const Member& member, Duration lateness) {
  if (lateness <= Duration::zero() || lateness > RoomOf(member)) return;
  State& state = states_[member];
  state.in_time = 0;
  state.most = std::max(state.most, lateness);
  if (++state.late >= kAgain) Lengthen(state, state.most);
}

void Patience::OnAnswered(const Member& member, Duration lateness) {
  State& state = states_[member];
  if (lateness > Duration::zero()) {
    state.in_time = 0;
    return Lengthen(state, lateness);
  }
  state.more -= state.more / kPartTakenOff;
  if (state.more < kLeastPatience) state.more = {};
  if (++state.in_time < kRepliesToForget) return;
  state.late = 0;
  state.most = {};
}

Duration Patience::More(const Member& member) const {
  return std::min(states_[member].more, RoomOf(member));
}

namespace {

/// Characters. Bytes that follow a good reply for longer are no copy of it.
constexpr int kLongestTrail = 256;
/// Bytes. A driver that releases the bus may leave this many; they are no second reply.
constexpr std::size_t kNoise = 3;

/// A device that was late is trusted again step by step: each good reply takes off this part.
constexpr int kDecay = 64;
constexpr Duration kForgotten = 1ms;

void Decay(Duration& time) {
  time -= time / kDecay;
  if (time < kForgotten) time = {};
}

/// Bytes.
std::size_t ShortestReply(const Asked& asked) {
  const std::vector<Shape>& shapes = asked.request->expect.shapes;
  if (shapes.empty()) return kNoise + 1;
  return std::ranges::min(shapes, {}, &Shape::min_length).min_length;
}

}  // namespace

Instant LateAnswers::LateUntil(const Member& member) const { return states_[member].late_until; }

void LateAnswers::OnEnd(const Asked& asked, Outcome outcome, Instant now) {
  last_ = asked.member;
  State& state = states_[*asked.member];
  state.late_from.reset();
  state.end = End::silent;
  state.absent = asked.lone_probe;
  state.after = 0;
  state.least = ShortestReply(asked);
  state.retried = {};
  if (!asked.retry) state.due.reset();
  const Instant due = asked.sent_out() + asked.reply_time();
  if (outcome == Outcome::no_reply) {
    state.late_from = now;
    if (!state.due) state.due = due;
  }
  if (outcome == Outcome::corrupt) state.end = End::corrupt;
  if (outcome == Outcome::partial) state.end = End::cut_short;
  if (!ProvesLife(outcome)) return;
  // The late reply to an earlier try was taken for that to the retry, whose own is still to come.
  if (asked.retry && state.due) {
    state.retried = now - *state.due;
    state.late_from = state.due = due;
  }
  if (!state.unanswered_since) state.end = End::answered;
}

LateAnswers::Stray LateAnswers::OnStray(const StrayBytes& stray, Instant now) {
  Stray told;
  // Too late for any answer: noise.
  if (last_ == nullptr || stray.since_end > last_->times.ceiling) return told;
  const Member& member = *last_;
  State& state = states_[member];
  told.counts = state.end != End::corrupt && state.end != End::cut_short;
  if (state.end == End::corrupt) return told;
  // The reply of another device is due, and this one has answered, or is absent. The diagnosis says
  // whose it is.
  const bool owes_none = state.end == End::answered || state.absent;
  if (owes_none && OthersMayAnswer(member, now)) return told;
  state.after += stray.count;
  // A driver that leaves the bus makes a byte, or a device ends its line twice.
  const bool harmless = state.end == End::answered && state.after == 1 && !member.protocol->tcp;
  if (harmless) told.counts = false;
  const bool may_be_reply = state.after >= state.least;
  // The repetition is answered as well: what came before was the late answer to its first try.
  if (may_be_reply) patience_.OnLate(member, std::exchange(state.retried, {}));
  if (may_be_reply && state.late_from && state.due && *state.late_from <= now) {
    told.late = &member;
    state.late_from.reset();
    told.lateness = now - *state.due;
    patience_.OnLate(member, told.lateness);
  }
  LearnSilence(state, member, stray, told);
  return told;
}

/// How long the silence after its exchanges has to be, so that such bytes meet no other request.
void LateAnswers::LearnSilence(State& state, const Member& member, const StrayBytes& stray,
                               Stray& told) {
  const LineTimes& times = member.times;
  const Duration needed = std::min(stray.since_end + times.gap, times.ceiling);
  if (state.end == End::answered) {
    if (state.after <= kNoise) return;
    // A second copy of the answer: not longer than an answer can be.
    const Duration longest = times.drain + kLongestTrail * times.character;
    if (stray.since_end <= longest) state.trail = std::max(state.trail, std::min(needed, longest));
    return;
  }
  if (needed <= times.drain + state.more_drain) return;
  state.more_drain = needed - times.drain;
  if (std::exchange(state.told_late, true)) return;
  told.warned = &member;
  const auto after = FormatDuration(std::chrono::round<std::chrono::milliseconds>(stray.since_end));
  told.warning =
      state.end == End::cut_short
          ? "the rest of a broken reply came " + after + " later; if this goes on, raise timing.gap"
          : "bytes came " + after +
                " after its exchange had ended; if this goes on, raise timing.reply";
}

bool LateAnswers::OthersMayAnswer(const Member& member, Instant at) const {
  return std::ranges::any_of(roster_.everyone(), [&](const Member* other) {
    return !other->IsSame(member) && states_[*other].late_until > at;
  });
}

/// Whether the awaited reply may still come. After an unexpected frame it may: that frame was
/// perhaps another device's late reply. After a damaged reply a device is checked by its probe, so
/// nothing is owed. A routed slave may still answer, unless the damaged bytes were as long as its
/// reply and no other reply was due.
bool LateAnswers::MayStillAnswer(const Asked& asked, const ExchangeEnd& end) const {
  if (end.outcome == Outcome::no_reply || end.outcome == Outcome::unexpected) return true;
  const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
  if (!damaged || asked.member->device != nullptr) return false;
  return OthersMayAnswer(*asked.member, asked.sent) ||
         std::ranges::none_of(asked.request->expect.shapes, [&](const Shape& shape) {
           return end.received >= shape.min_length && end.received <= shape.max_length;
         });
}

void LateAnswers::SetWait(const Asked& asked, const ExchangeEnd& end, bool nothing_to_wait_for,
                          Instant now) {
  const Member& member = *asked.member;
  const LineTimes& times = member.times;
  State& state = states_[member];
  if (MayStillAnswer(asked, end)) {
    // A reply under a wrong address is still this device's reply: the request is closed. It stays
    // open only after silence, or where replies carry no address.
    const bool open = end.outcome == Outcome::no_reply || !asked.named();
    if (open && !state.unanswered_since) state.unanswered_since = asked.sent;
    // Probes of a device that is offline would cost the others this time again and again.
    if (asked.lone_probe && asked.named()) return;
    // A connection that was closed ends the exchange long before its reply time.
    const Instant by_end = std::max(now + times.ceiling - times.reply, asked.sent + times.ceiling);
    const Instant by_request = asked.sent_out() + times.ceiling;
    SetLate(member, member.device != nullptr ? by_end : std::max(by_request, by_end));
    return;
  }
  const bool answered =
      ProvesLife(end.outcome) && asked.request->expect.reply != Expectation::Reply::none;
  if (!answered) return;
  // Where replies carry no address, a reply that is owed could pass for another device's.
  const bool owed = state.unanswered_since && !nothing_to_wait_for && !asked.named();
  SetLate(member, owed ? asked.sent_out() + times.ceiling : Instant{});
  if (!asked.retry) patience_.OnAnswered(member, Lateness(asked, end));
  state.unanswered_since.reset();
  Decay(state.more_drain);
  Decay(state.trail);
}

Duration LateAnswers::Lateness(const Asked& asked, const ExchangeEnd& end) {
  const Duration character = asked.member->times.character;
  const Duration received = static_cast<std::int64_t>(end.received) * character;
  return end.round_trip - received - TransmissionTime(*asked.request, character) -
         asked.reply_time();
}

void LateAnswers::OnClosed(const Member& member, Instant now) {
  const LineTimes& times = member.times;
  SetLate(member, now + (roster_.is_network() ? times.ceiling : times.reply + times.drain));
}

Instant LateAnswers::AllClearAt() const {
  Instant clear{};
  for (const Member* member : roster_.everyone()) {
    clear = std::max(clear, states_[*member].late_until);
  }
  return clear;
}

Instant LateAnswers::ClearAt(const Asked& asked) const {
  Instant clear{};
  for (const Member* other : roster_.everyone()) {
    if (other->IsSame(*asked.member) || !asked.named()) {
      clear = std::max(clear, states_[*other].late_until);
    }
  }
  return clear;
}

Duration LateAnswers::ExtraDrain(const Member& member) const { return states_[member].more_drain; }

/// The request was sent n times, and one reply has come. It may be the reply to the first try; the
/// other n - 1 may still follow, the last within (now - first try) plus the lateness of the device.
/// Wait that long, at most the ceiling.
Duration LateAnswers::Aftermath(const Asked& asked, Instant now) const {
  const State& state = states_[*asked.member];
  if (asked.request->any_order || asked.request->numbered) return {};  // they do no harm
  if (!asked.retry || !state.unanswered_since) return state.trail;
  const LineTimes& times = asked.member->times;
  const Duration since = now - *state.unanswered_since + times.gap + state.more_drain;
  return std::min(std::max(since, state.trail), times.ceiling);
}

Duration LateAnswers::LongestReply() const {
  Duration longest{};
  for (const Member* one : roster_.everyone()) longest = std::max(longest, one->times.reply);
  return longest;
}

Duration LateAnswers::WorstCase(const Member& member) const {
  const LineTimes& times = member.times;
  return times.quiet + 32 * times.character + times.reply + times.drain +
         states_[member].more_drain;
}

void LateAnswers::SetLate(const Member& member, Instant until) {
  for (const Member* one : roster_.everyone()) {
    if (one->IsSame(member)) states_[*one].late_until = until;
  }
}

}  // namespace baudgate
