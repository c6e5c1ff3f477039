// The two tables of `LateReplies`. The reply time, the drain and the ceiling (the latest end of an
// exchange) are members of LineTimes (gateway/bus/exchange/line.h). A slave of routes is not
// configured; only clients of transparent routes ask it.
//
// After an exchange a reply may still come (MayStillAnswer), so the next requests wait (SetWait):
//
// clang-format off
//   the exchange ended as     what may still come                      requests wait until
//   no_reply, unexpected      the reply                                the ceiling of the request
//   corrupt, partial          from a device: nothing, because a probe  -
//                             shows whether replies come in order
//                             from a slave of routes: the reply,       the ceiling of the request
//                             unless the damaged bytes were as long
//                             as a reply
//   line_down                 the reply                                the reply time and the drain are over;
//                                                                      behind a serial server: the ceiling
//   an answer after silence   if replies carry no address: the         the ceiling of the request
//                             replies to the earlier tries
//   an answer                 a copy, or noise                         -
//
// Bytes that belong to no exchange (OnStray) are judged by the outcome of the exchange before them:
//
//   it ended as               the bytes are                            what follows
//   corrupt                   the rest of the damaged reply            nothing
//   partial                   the rest of a reply that broke off       a longer silence after failures
//   an answer                 one byte: noise of a driver that         nothing
//                             releases the bus
//                             more than three bytes: a copy            a silence after good replies
//   an answer to a retry      if as long as a reply: the reply to      more patience; a late reply is
//                             the retry itself                         counted
//   no_reply                  if as long as a reply: the late reply    more patience; a late reply is
//                                                                      counted; a longer silence after failures
//   an answer, or a failed    if a reply of another device is          TakeOthers finds the reply by its
//   probe of an offline       expected: this reply                     address
//   device
// clang-format on
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/replies/late_replies.h"

#include <algorithm>
#include <utility>

namespace baudgate::bus {

namespace {

constexpr int kAgain = 2;
/// After this many replies in time, the earlier late replies are forgotten.
constexpr int kRepliesToForget = 100;
/// Each reply in time shortens the extra reply time (Patience) by this part (1 / kPartTakenOff).
constexpr int kPartTakenOff = 1024;
constexpr Duration kLeastPatience = 1ms;

/// Returns the greatest extra reply time: with it the exchange still ends within
/// LineTimes::ceiling.
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

/// In characters. Bytes that come later than this (plus LineTimes::drain) after a good reply are
/// not a copy of the reply.
constexpr int kLongestTrail = 256;
/// In bytes. So few bytes are not a reply, because a driver that releases the bus can cause them.
constexpr std::size_t kNoise = 3;
/// In bytes: how many received bytes are searched for late replies of other devices.
constexpr std::size_t kMostHeard = 1024;
/// Greatest lateness of a late reply that TakeOthers counts. It can be above LineTimes::ceiling:
/// the counter `late` then shows that the ceiling is too short.
constexpr Duration kLatest = 1min;

/// Each good reply shortens the learned silences (more_drain and trail) by this part (1 / kDecay).
constexpr int kDecay = 64;
constexpr Duration kForgotten = 1ms;

void Decay(Duration& time) {
  time -= time / kDecay;
  if (time < kForgotten) time = {};
}

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
  // Perhaps the late reply to an earlier try has answered the retry. The reply to the retry itself
  // may then still come.
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
  // After LineTimes::ceiling no reply can come, so the bytes are noise.
  if (last_ == nullptr || stray.since_end > last_->times.ceiling) return effects;
  const Member& member = *last_;
  Entry& entry = entries_[member];
  Last& last = entry.last;
  effects.counts = last.end != Last::End::corrupt && last.end != Last::End::cut_short;
  if (last.end == Last::End::corrupt) return effects;
  // No reply of the last device can come, but a reply of another device may come. The bytes may be
  // this reply, so TakeOthers searches them.
  const bool owes_none = last.end == Last::End::answered || last.absent;
  if (owes_none && OthersMayAnswer(member, now)) return effects;
  last.after += stray.count;
  // A single byte comes from a driver that releases the bus, or from a device that repeats its line
  // end.
  const bool harmless = last.end == Last::End::answered && last.after == 1 && !member.protocol->tcp;
  if (harmless) effects.counts = false;
  const bool may_be_reply = last.after >= last.least;
  // The bytes may be the reply to the retry. Then the reply that was accepted for the retry was the
  // late reply to the first try.
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

/// Returns when a reply of the member to this request was received; empty: it is not among the
/// bytes.
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

/// Makes the silence after exchanges of the member longer, so that bytes as late as these come
/// before the next request.
void LateReplies::LearnSilence(Entry& entry, const Member& member, const StrayBytes& stray,
                               StrayEffects& effects) {
  const LineTimes& times = member.times;
  const Duration needed = std::min(stray.since_end + times.gap, times.ceiling);
  if (entry.last.end == Last::End::answered) {
    if (entry.last.after <= kNoise) return;
    // A copy of a reply comes at most as late as the longest reply takes.
    const Duration longest = times.drain + kLongestTrail * times.character;
    if (stray.since_end <= longest) entry.trail = std::max(entry.trail, std::min(needed, longest));
    return;
  }
  if (needed <= times.drain + entry.more_drain) return;
  entry.more_drain = needed - times.drain;
  if (std::exchange(entry.told_late, true)) return;
  effects.warned = &member;
  const auto after = FormatDuration(std::chrono::round<std::chrono::milliseconds>(stray.since_end));
  effects.warning = entry.last.end == Last::End::cut_short
                        ? "the rest of an incomplete reply came " + after +
                              " later; if this goes on, raise timing.gap in the configuration"
                        : "bytes came " + after +
                              " after its exchange had ended; if this goes on, raise timing.reply "
                              "in the configuration";
}

bool LateReplies::OthersMayAnswer(const Member& member, Instant at) const {
  return std::ranges::any_of(roster_.everyone(), [&](const Member* other) {
    return !other->IsSame(member) && entries_[*other].late_until > at;
  });
}

/// True if the reply may still come after the exchange has failed:
/// * After silence the reply may be late.
/// * After an unexpected frame the reply may come, because the frame may be the late reply of
///   another device.
/// * After a damaged reply of a configured device no reply is waited for, because a probe will show
///   whether replies come in order.
/// * After a damaged reply of a slave without configuration the reply may come, unless the damaged
///   bytes were as long as the reply and no reply of another member could come.
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
    // If replies carry addresses and an unexpected frame came, the device has answered, so no reply
    // is missing. After silence, or if replies carry no address, a reply is missing.
    const bool open = end.outcome == Outcome::no_reply || !asked.named();
    if (open && !entry.unanswered_since) entry.unanswered_since = asked.sent;
    // A probe of an offline device must not make the other devices wait this long each time.
    if (asked.lone_probe && asked.named()) return;
    // If the server closed the connection, the exchange has ended before its reply time, but the
    // reply may come until LineTimes::ceiling is over.
    const Instant by_end = std::max(now + times.ceiling - times.reply, asked.sent + times.ceiling);
    const Instant by_request = asked.sent_out() + times.ceiling;
    SetLate(member, member.device != nullptr ? by_end : std::max(by_request, by_end));
    return;
  }
  const bool answered =
      ProvesLife(end.outcome) && asked.request->expect.reply != protocols::Expectation::Reply::none;
  if (!answered) return;
  // A reply to an earlier try may still come. If it carries no address, it could be mistaken for
  // the reply of another device, so all requests wait for it.
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

/// Returns the silence after a good reply. If the request was sent n times, the reply may be the
/// reply to the first try, and n - 1 replies may follow. They come within the time since the first
/// try, plus the lateness of earlier replies (more_drain); LineTimes::ceiling is the limit.
Duration LateReplies::Aftermath(const Asked& asked, Instant now) const {
  const Entry& entry = entries_[*asked.member];
  // The reply carries a number or is correct for any request (any_order), so late replies do no
  // harm.
  if (asked.request->any_order || asked.request->numbered) return {};
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
