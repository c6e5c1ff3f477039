// A member may still send a reply after its last exchange has ended (MayStillAnswer), and requests
// wait for that reply for some time (SetWait):
//
// clang-format off
//   the exchange ended as     what may still come                      it is waited for until
//   no_reply, unexpected      its reply                                the ceiling of the request
//   corrupt, partial          nothing: a probe checks the device. Of   the same
//                             a slave of routes its reply, unless
//                             what came was as long
//   line_down                 its reply                                the reply time and the drain;
//                                                                      behind a server the ceiling
//   an answer after silence   where replies name nobody: the replies   the ceiling of the request
//                             to the earlier tries
//   an answer                 a copy, or noise                         -
//
// Bytes that belong to no exchange (OnStray) mean, by the end of the exchange before them:
//
//   it ended as               the bytes are                            they lead to
//   corrupt                   the rest of the damaged reply            nothing
//   partial                   the rest of a reply that broke off       a longer silence behind failures
//   an answer                 one: the driver that leaves the bus      nothing
//                             more than three: a copy                  a silence behind good replies
//   an answer to a retry      as long as a reply: that of the retry    patience; a late reply is counted
//   no_reply                  as long as a reply: the late reply       the same, and the longer silence
//   any, another's is due     that of another device, if this one      TakeOthers finds it by its address
//                             has answered or is absent
// clang-format on
//
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/replies/late_replies.h"

#include <algorithm>
#include <utility>

namespace baudgate::bus {

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

void Patience::Lengthen(Entry& entry, Duration lateness) {
  entry.more = std::max(entry.more, lateness + lateness / 4);
}

void Patience::OnLate(const Member& member, Duration lateness) {
  if (lateness <= Duration::zero() || lateness > RoomOf(member)) return;
  Entry& entry = entries_[member];
  entry.in_time = 0;
  entry.most = std::max(entry.most, lateness);
  if (++entry.late_count >= kAgain) Lengthen(entry, entry.most);
}

void Patience::OnAnswered(const Member& member, Duration lateness) {
  Entry& entry = entries_[member];
  if (lateness > Duration::zero()) {
    entry.in_time = 0;
    return Lengthen(entry, lateness);
  }
  entry.more -= entry.more / kPartTakenOff;
  if (entry.more < kLeastPatience) entry.more = {};
  if (++entry.in_time < kRepliesToForget) return;
  entry.late_count = 0;
  entry.most = {};
}

Duration Patience::More(const Member& member) const {
  return std::min(entries_[member].more, RoomOf(member));
}

namespace {

/// Characters. Bytes that follow a good reply for longer are no copy of it.
constexpr int kLongestTrail = 256;
/// Bytes. A driver that releases the bus may leave this many; they are no second reply.
constexpr std::size_t kNoise = 3;
/// Bytes that are searched for the late replies of others.
constexpr std::size_t kMostHeard = 1024;
/// Even beyond the ceiling a reply of another is counted, because `late` shows that a ceiling is
/// too short.
constexpr Duration kLatest = 1min;

/// A device that was late is trusted again step by step: each good reply takes off this part.
constexpr int kDecay = 64;
constexpr Duration kForgotten = 1ms;

void Decay(Duration& time) {
  time -= time / kDecay;
  if (time < kForgotten) time = {};
}

/// Bytes.
std::size_t ShortestReply(const Asked& asked) {
  const std::vector<protocols::Shape>& shapes = asked.request->expect.shapes;
  if (shapes.empty()) return kNoise + 1;
  return std::ranges::min(shapes, {}, &protocols::Shape::min_length).min_length;
}

}  // namespace

Instant LateReplies::LateUntil(const Member& member) const { return entries_[member].late_until; }

LateReplies::Last LateReplies::LastOf(const Entry& before, const Asked& asked, Outcome outcome,
                                      Instant now) {
  Last last{.absent = asked.lone_probe,
            .least = ShortestReply(asked),
            .due = asked.retry ? before.last.due : std::nullopt};
  const Instant due = asked.sent_out() + asked.reply_time();
  if (outcome == Outcome::no_reply) {
    last.late_from = now;
    if (!last.due) last.due = due;
    if (asked.named()) last.request = *asked.request;
  }
  if (outcome == Outcome::corrupt) last.end = Last::End::corrupt;
  if (outcome == Outcome::partial) last.end = Last::End::cut_short;
  if (!ProvesLife(outcome)) return last;
  // The late reply to an earlier try was taken for that to the retry, whose own is still to come.
  if (asked.retry && last.due) {
    last.retried = now - *last.due;
    last.late_from = last.due = due;
  }
  if (!before.unanswered_since) last.end = Last::End::answered;
  return last;
}

void LateReplies::OnEnded(const Asked& asked, const ExchangeEnd& end, bool nothing_to_wait_for,
                          Instant now) {
  last_ = asked.member;
  Entry& entry = entries_[*asked.member];
  entry.last = LastOf(entry, asked, end.outcome, now);
  if (end.outcome == Outcome::line_down) return OnClosed(*asked.member, now);
  SetWait(asked, end, nothing_to_wait_for, now);
}

LateReplies::StrayEffects LateReplies::OnStray(const StrayBytes& stray, Instant now) {
  StrayEffects effects;
  // Too late for any answer: noise.
  if (last_ == nullptr || stray.since_end > last_->times.ceiling) return effects;
  const Member& member = *last_;
  Entry& entry = entries_[member];
  Last& last = entry.last;
  effects.counts = last.end != Last::End::corrupt && last.end != Last::End::cut_short;
  if (last.end == Last::End::corrupt) return effects;
  // The reply of another device is due, and this one has answered, or is absent: see TakeOthers.
  const bool owes_none = last.end == Last::End::answered || last.absent;
  if (owes_none && OthersMayAnswer(member, now)) return effects;
  last.after += stray.count;
  // A driver that leaves the bus makes a byte, or a device ends its line twice.
  const bool harmless = last.end == Last::End::answered && last.after == 1 && !member.protocol->tcp;
  if (harmless) effects.counts = false;
  const bool may_be_reply = last.after >= last.least;
  // The repetition is answered as well: what came before was the late answer to its first try.
  if (may_be_reply) patience_.OnLate(member, std::exchange(last.retried, {}));
  if (may_be_reply && last.late_from && last.due && *last.late_from <= now) {
    effects.late_member = &member;
    last.late_from.reset();
    effects.lateness = now - *last.due;
    patience_.OnLate(member, effects.lateness);
  }
  LearnSilence(entry, member, stray, effects);
  return effects;
}

void LateReplies::Hear(View bytes, Instant now) {
  if (heard_.size() == kMostHeard) return;
  Append(heard_, bytes.first(std::min(bytes.size(), kMostHeard - heard_.size())));
  pieces_.push_back({heard_.size(), now});
}

/// When a reply of the member to this request has come. Empty: none is among the bytes.
std::optional<Instant> LateReplies::AnsweredAt(const Member& member,
                                               const protocols::Request& request) const {
  protocols::Assembler assembler;
  assembler.Begin(member.protocol->reply_rule, request.expect);
  std::size_t fed = 0;
  for (const Piece& piece : pieces_) {
    assembler.Feed(View(heard_).subspan(fed, piece.end - fed));
    fed = piece.end;
    while (const auto frame = assembler.Next(fed == heard_.size())) {
      const bool fits = member.device == nullptr ||
                        ProvesLife(member.device->conversation->Check(request.bytes, *frame));
      if (fits) return piece.at;
    }
  }
  return std::nullopt;
}

std::vector<LateReplies::Late> LateReplies::TakeOthers() {
  std::vector<Late> found;
  if (heard_.empty()) return found;
  for (const Member* member : roster_.everyone()) {
    Last& last = entries_[*member].last;
    const bool awaited = last.late_from && last.due && !last.request.bytes.empty();
    if (!awaited || last_ == nullptr || member->IsSame(*last_)) continue;
    const auto at = AnsweredAt(*member, last.request);
    if (!at || *at <= *last.due || *at - *last.due > kLatest) continue;
    last.late_from.reset();
    found.push_back({member, *at - *last.due});
  }
  heard_.clear();
  pieces_.clear();
  return found;
}

/// How long the silence after its exchanges has to be, so that such bytes meet no other request.
void LateReplies::LearnSilence(Entry& entry, const Member& member, const StrayBytes& stray,
                               StrayEffects& effects) {
  const LineTimes& times = member.times;
  const Duration needed = std::min(stray.since_end + times.gap, times.ceiling);
  if (entry.last.end == Last::End::answered) {
    if (entry.last.after <= kNoise) return;
    // A second copy of the answer: not longer than an answer can be.
    const Duration longest = times.drain + kLongestTrail * times.character;
    if (stray.since_end <= longest) entry.trail = std::max(entry.trail, std::min(needed, longest));
    return;
  }
  if (needed <= times.drain + entry.more_drain) return;
  entry.more_drain = needed - times.drain;
  if (std::exchange(entry.told_late, true)) return;
  effects.warned = &member;
  const auto after = FormatDuration(std::chrono::round<std::chrono::milliseconds>(stray.since_end));
  effects.warning =
      entry.last.end == Last::End::cut_short
          ? "the rest of a broken reply came " + after + " later; if this goes on, raise timing.gap"
          : "bytes came " + after +
                " after its exchange had ended; if this goes on, raise timing.reply";
}

bool LateReplies::OthersMayAnswer(const Member& member, Instant at) const {
  return std::ranges::any_of(roster_.everyone(), [&](const Member* other) {
    return !other->IsSame(member) && entries_[*other].late_until > at;
  });
}

/// Whether the awaited reply may still come. After an unexpected frame it may: that frame was
/// perhaps another device's late reply. After a damaged reply a device is checked by its probe, so
/// nothing is owed. A routed slave may still answer, unless the damaged bytes were as long as its
/// reply and no other reply was due.
bool LateReplies::MayStillAnswer(const Asked& asked, const ExchangeEnd& end) const {
  if (end.outcome == Outcome::no_reply || end.outcome == Outcome::unexpected) return true;
  const bool damaged = end.outcome == Outcome::corrupt || end.outcome == Outcome::partial;
  if (!damaged || asked.member->device != nullptr) return false;
  return OthersMayAnswer(*asked.member, asked.sent) ||
         std::ranges::none_of(asked.request->expect.shapes, [&](const protocols::Shape& shape) {
           return end.received >= shape.min_length && end.received <= shape.max_length;
         });
}

void LateReplies::SetWait(const Asked& asked, const ExchangeEnd& end, bool nothing_to_wait_for,
                          Instant now) {
  const Member& member = *asked.member;
  const LineTimes& times = member.times;
  Entry& entry = entries_[member];
  if (MayStillAnswer(asked, end)) {
    // A reply under a wrong address is still this device's reply: the request is closed. It stays
    // open only after silence, or where replies carry no address.
    const bool open = end.outcome == Outcome::no_reply || !asked.named();
    if (open && !entry.unanswered_since) entry.unanswered_since = asked.sent;
    // Probes of a device that is offline would cost the others this time again and again.
    if (asked.lone_probe && asked.named()) return;
    // A connection that was closed ends the exchange long before its reply time.
    const Instant by_end = std::max(now + times.ceiling - times.reply, asked.sent + times.ceiling);
    const Instant by_request = asked.sent_out() + times.ceiling;
    SetLate(member, member.device != nullptr ? by_end : std::max(by_request, by_end));
    return;
  }
  const bool answered =
      ProvesLife(end.outcome) && asked.request->expect.reply != protocols::Expectation::Reply::none;
  if (!answered) return;
  // Where replies carry no address, a reply that is owed could pass for another device's.
  const bool owed = entry.unanswered_since && !nothing_to_wait_for && !asked.named();
  SetLate(member, owed ? asked.sent_out() + times.ceiling : Instant{});
  if (!asked.retry) patience_.OnAnswered(member, Lateness(asked, end));
  entry.unanswered_since.reset();
  Decay(entry.more_drain);
  Decay(entry.trail);
}

Duration LateReplies::Lateness(const Asked& asked, const ExchangeEnd& end) {
  const Duration character = asked.member->times.character;
  const Duration received = static_cast<std::int64_t>(end.received) * character;
  return end.round_trip - received - TransmissionTime(*asked.request, character) -
         asked.reply_time();
}

void LateReplies::OnClosed(const Member& member, Instant now) {
  const LineTimes& times = member.times;
  SetLate(member, now + (roster_.is_network() ? times.ceiling : times.reply + times.drain));
}

Instant LateReplies::AllClearAt() const {
  Instant clear{};
  for (const Member* member : roster_.everyone()) {
    clear = std::max(clear, entries_[*member].late_until);
  }
  return clear;
}

Instant LateReplies::ClearAt(const Asked& asked) const {
  Instant clear{};
  for (const Member* other : roster_.everyone()) {
    if (other->IsSame(*asked.member) || !asked.named()) {
      clear = std::max(clear, entries_[*other].late_until);
    }
  }
  return clear;
}

Duration LateReplies::ExtraDrain(const Member& member) const { return entries_[member].more_drain; }

/// The request was sent n times, and one reply has come. It may be the reply to the first try; the
/// other n - 1 may still follow, the last within (now - first try) plus the lateness of the device.
/// Wait that long, at most the ceiling.
Duration LateReplies::Aftermath(const Asked& asked, Instant now) const {
  const Entry& entry = entries_[*asked.member];
  if (asked.request->any_order || asked.request->numbered) return {};  // they do no harm
  if (!asked.retry || !entry.unanswered_since) return entry.trail;
  const LineTimes& times = asked.member->times;
  const Duration since = now - *entry.unanswered_since + times.gap + entry.more_drain;
  return std::min(std::max(since, entry.trail), times.ceiling);
}

Duration LateReplies::LongestReply() const {
  Duration longest{};
  for (const Member* one : roster_.everyone()) longest = std::max(longest, one->times.reply);
  return longest;
}

Duration LateReplies::WorstCase(const Member& member) const {
  const LineTimes& times = member.times;
  return times.quiet + 32 * times.character + times.reply + times.drain +
         entries_[member].more_drain;
}

void LateReplies::SetLate(const Member& member, Instant until) {
  for (const Member* one : roster_.everyone()) {
    if (one->IsSame(member)) entries_[*one].late_until = until;
  }
}

}  // namespace baudgate::bus
