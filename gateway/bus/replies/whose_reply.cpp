// The table of `WhoseReply`: which request a reply answers. A reply is "owed" while it may still
// come. A and B are devices; a stranger is another master that used the port before. The words
// proven, elsewhere, shifted, replaced and odd are members of WhoseReply::Verdict.
//
//   UA1, UA2, ?A1   polls of A
//   PA0             a probe that asks A for its name; the reply is !A0
//   !A1=5           a reply that contains the number of its request: it answers ?A1
//   !=1             a reply without that number: it may answer UA1 and UA2. Example: a reply of two
//                   registers in Modbus RTU does not contain which two
//
// clang-format off
//    may be owed                  asked     comes      it is                            follows
//  1 nothing                      UA1       !=1        the reply to UA1                 proven: the reading counts
//  2 nothing                      UA1       !A0        an earlier reply that came       shifted: the latest readings
//                                                      twice                            are read again
//  3 a reply to UA1               UA2       !=1        the reply to UA1 or to UA2       not proven: UA2 is asked again
//  4 a reply to UA1               UA1       !=1        the reply to one of the two      proven; perhaps older, by the time
//                                                      UA1                              between the two
//  5 a reply to UA1, which was    ?A1       !A1=5      the reply to ?A1: replies to     proven; nothing is owed
//    answered before                                   UA1 have another form
//  6 a reply to UA1               PA0       !=1        the reply to UA1                 elsewhere: A lags by one reply
//  7 a reply to UA1               PA0       !A0        the reply to PA0                 proven; nothing is owed
//  8 a reply to PA0               UA1       !A0        the reply to PA0                 elsewhere; one is owed as before
//  9 nothing; the name is known   PA0       !A0=2      the name of another device, or   shifted; the second time in a row:
//                                                      damage                           replaced, everything is read again
// 10 nothing; the name is known   UA1 as    !=1        the eighth probe in a row that   replaced, by a device without
//                                 a probe              is answered without a name       a name
// 11 three replies to a stranger  PA0 four  !A0        the fourth reply, so it answers  proven; nothing is owed (if the
//                                 times                one of the PA0                   probe is a read: see Learn)
// 12 a reply of B, without        UA1       !=1        the reply of A or of B           not proven: UA1 is asked again
//    an address
// 13 a reply of B, with its       ?A1       !A1=5      the reply of A                   proven
//    address
// 14 nothing; PA0 was answered    UA1       !A9        the reply to UA1, in a form      odd: a probe goes before UA1 from
//    directly before                                   that was not asked for           now on; other readings stay good
// 15 a reply to UA1, which was    ?A1       !A1=5      the reply to UA1 or to ?A1: the  not proven: ?A1 is asked again,
//    never answered                                    form of replies to UA1 is        until UA1 is not among the last
//                                                      unknown                          four requests
// 16 a reply to ?A0; the name     PA0       !A0=7      the reply to ?A0 or to PA0       not proven: PA0 is asked again
//    is "!A0=7"
// 17 nothing                      ?A1,      !=1        a copy as in row 2, so the       the next reply may answer any
//                                 then UA1             order of replies is lost         earlier request, until a proof
// 18 a reply of B, with its       ?A1       !B1=5      the reply of B                   elsewhere; A owes as many replies
//    address                                                                            as before
// clang-format on
//
// A refusal (!A0~refused) can answer any request. It proves which request it answers only if the
// device refuses to give its name. Each row has a test with its number in
// tests/gateway/bus/replies/whose_reply_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/replies/whose_reply.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace baudgate::bus {

namespace {

constexpr std::size_t kRemembered = AnswerOrder::kMostOwed + 1;

constexpr std::uint64_t Bit(std::size_t number) { return std::uint64_t{1} << number; }

}  // namespace

void AnswerOrder::OnSent(const SentRequest& request) {
  sent_[++count_ % sent_.size()] = request;
  // The bit of the oldest stored request stands for this request and all older ones.
  answered_ = (answered_ << 1U) | (answered_ & Bit(kMostOwed));
}

void AnswerOrder::OnStranger(Instant now) {
  for (std::size_t lag = 0; lag < Owed(); ++lag) {
    if (SentBefore(lag).place == SentRequest::kStranger) return;
  }
  for (std::size_t i = 0; i < kMostOfStrangers; ++i) {
    OnSent({SentRequest::kStranger, {}, now, false});
    answered_ |= 1;
  }
}

/// Removes the requests of other masters ("?") from the order. Three examples with requests a and b
/// of this gateway; "^" marks the requests that may have been answered last:
///
///   before the call    a ? ? b      a ? ? b      a ? ? b
///                        ^ ^        ^ ^ ^              ^
///   after the call     a b          a b          a b
///                      ^            ^              ^
void AnswerOrder::ForgetStrangers() {
  std::vector<SentRequest> ours;  // the latest request is the first
  std::uint64_t answered = 0;
  for (std::size_t lag = 0; lag <= kMostOwed; ++lag) {
    if ((answered_ & Bit(lag)) != 0) answered |= Bit(ours.size());
    if (SentBefore(lag).place != SentRequest::kStranger) ours.push_back(SentBefore(lag));
  }
  for (std::size_t lag = 0; lag < ours.size(); ++lag) {
    sent_[(count_ - lag) % sent_.size()] = std::move(ours[lag]);
  }
  answered_ = answered;
}

/// Returns which requests the reply may answer: bit n stands for the request that was sent n
/// requests before the latest one. Checks n from `nearest` to `end` - 1. Any reply may answer a
/// request of another master, but only while the reply to this request may still come.
std::uint64_t AnswerOrder::Fitting(std::size_t nearest, std::size_t end,
                                   const MayAnswer& may_answer) const {
  std::uint64_t fitting = 0;
  for (std::size_t lag = nearest; lag < end; ++lag) {
    const SentRequest& sent = SentBefore(lag);
    const bool strange = sent.place == SentRequest::kStranger;
    if (strange ? lag < Owed() : may_answer(sent, lag)) fitting |= Bit(lag);
  }
  return fitting;
}

bool AnswerOrder::OnAnswer(bool fits, const MayAnswer& may_answer) {
  // Replies come in order, so only requests after the request that was answered last are checked.
  const std::uint64_t fitting = (fits ? 1 : 0) | Fitting(1, Owed(), may_answer);
  if (fitting != 0) answered_ = fitting;
  return fitting != 0;
}

/// Marks all earlier requests as possibly answered last. Requests of other masters to which no
/// reply can come any more are removed.
void AnswerOrder::OnLost() {
  for (std::size_t lag = Owed(); lag <= kMostOwed; ++lag) {
    SentRequest& sent = sent_[(count_ - lag) % sent_.size()];
    if (sent.place == SentRequest::kStranger) sent.place = SentRequest::kNobody;
  }
  answered_ = ~std::uint64_t{1};
}

bool AnswerOrder::IsBehindProof() const {
  std::size_t before = 1;
  while (before < kMostOwed && IsSame(before)) ++before;
  const SentRequest& sent = SentBefore(before);
  return sent.proof && Owed() <= before;
}

bool AnswerOrder::MayBeEarlier(const MayAnswer& may_answer) const {
  return Fitting(1, kRemembered, may_answer) != 0;
}

void AnswerOrder::OnCopy() {
  if (Owed() < kMostOwed) answered_ |= answered_ << 1U;
}

bool AnswerOrder::Owes(const std::function<bool(const SentRequest&)>& is_one) const {
  for (std::size_t lag = 0; lag < Owed(); ++lag) {
    if (is_one(SentBefore(lag))) return true;
  }
  return false;
}

bool AnswerOrder::Remembers(const MayAnswer& is_one) const {
  for (std::size_t lag = 0; lag < kRemembered; ++lag) {
    if (is_one(SentBefore(lag), lag)) return true;
  }
  return false;
}

bool AnswerOrder::IsSafe() const {
  return !Owes([](const SentRequest& sent) { return !sent.proof; });
}

bool AnswerOrder::IsAnswerTo(const Bytes& request) const {
  for (std::size_t lag = 0; lag <= Owed(); ++lag) {
    if ((answered_ & Bit(lag)) == 0) continue;
    const bool same = SentBefore(lag).context == SentBefore(0).context;
    if (!same || SentBefore(lag).bytes != request) return false;
  }
  return true;
}

bool AnswerOrder::IsOfLatest() const {
  for (std::size_t lag = 1; lag <= Owed(); ++lag) {
    if (!IsSame(lag)) return false;
  }
  return true;
}

void LostReplies::OnLost(const Member& slave, const Bytes& request, Instant now) {
  Entry& entry = entries_[slave];
  if (!MayCome(slave, now)) entry.requests.clear();
  if (entry.requests.size() == kMost) entry.requests.erase(entry.requests.begin());
  entry.requests.push_back(request);
  entry.lost_at = now;
}

bool LostReplies::MayCome(const Member& slave, Instant began) const {
  const std::optional<Instant>& lost_at = entries_[slave].lost_at;
  return lost_at && began - *lost_at <= kLatest;
}

LostReplies::Older LostReplies::MayBe(const Member& slave, const Bytes& request, Instant began,
                                      const MayFit& fits) const {
  Older older;
  if (!MayCome(slave, began)) return older;
  for (const Bytes& lost : entries_[slave].requests) {
    const bool same = lost == request;
    older.same = older.same || same;
    older.other = older.other || (!same && fits(lost));
  }
  return older;
}

bool LostReplies::OnReply(const Member& slave, const Bytes& request, Older older,
                          std::size_t count) {
  std::vector<Bytes>& lost = entries_[slave].requests;
  if ((!older.other && !older.same) || count > lost.size()) {
    lost.clear();
    return true;
  }
  // The reply to an earlier request has come late, so the reply to the present request may also
  // come late.
  lost.erase(lost.begin());
  lost.push_back(request);
  return !older.other;
}

namespace {

/// Removes the line end, because it is not compared: a line feed after the carriage return may be
/// missing, or come with the next bytes.
View WithoutLineEnd(View frame) {
  while (!frame.empty() && (frame.back() == '\r' || frame.back() == '\n')) {
    frame = frame.first(frame.size() - 1);
  }
  return frame;
}

}  // namespace

bool Identity::Is(View reply) const {
  return known() && std::ranges::equal(WithoutLineEnd(reply), reply_);
}

void Identity::Learn(const Bytes& request, View reply, Outcome outcome) {
  const View frame = WithoutLineEnd(reply);
  request_ = request;
  reply_.assign(frame.begin(), frame.end());
  names_ = outcome == Outcome::ok;
  other_.clear();
  certain_ = false;
}

bool Identity::OnOther(View reply) {
  const View frame = WithoutLineEnd(reply);
  if (std::ranges::equal(frame, other_)) return true;
  other_.assign(frame.begin(), frame.end());
  return false;
}

namespace {

/// True for refusals such as "no" and "not now": the device answers, but the same answer fits any
/// request.
bool IsRefusal(Outcome outcome) { return ProvesLife(outcome) && outcome != Outcome::ok; }

}  // namespace

bool WhoseReply::IsSafe(const Asked& asked) const {
  if (asked.request->is_proof()) return true;
  return orders_.IsSafe(asked);
}

bool WhoseReply::NeedsProbeFirst(const Asked& asked, Instant now) const {
  const Member& member = *asked.member;
  const bool answered = asked.request->expect.reply == protocols::Expectation::Reply::one;
  if (!asked.first || !answered || !member.in_use || member.device == nullptr) return false;
  if (asked.unprovable) return false;
  const Entry& entry = entries_[member];
  const Duration holds = asked.renews_proof_early ? kProofRenews : kProofHolds;
  if (!entry.answered_probe || now - entry.proven_at > holds) return true;
  if (IsUnprovable(member)) return false;
  const bool odd = std::ranges::find(entry.odd, asked.question()) != entry.odd.end();
  if (odd && !asked.proved && entry.proofless == 0) return true;  // row 14 of the table at the top
  if (IsSafe(asked)) return false;
  // Each retry gets the next pending reply. So retries reach the right reply if no more replies are
  // pending than at the latest proof (`lag`), and at most four. Otherwise a probe is better: after
  // 22 unanswered requests 22 replies may come.
  return orders_.Owed(asked) > std::min(entry.lag, kMostTriesMore);
}

bool WhoseReply::IsProbedByWrites(const Device& device) const {
  return device.conversation->Queries().empty() && entries_[device].proof_reply.empty();
}

bool WhoseReply::IsOwedAlone(const Asked& asked) const {
  if (asked.member->device != nullptr) return orders_.Owed(asked) == 1;
  return !lost_.MayCome(*asked.member, asked.sent);
}

void WhoseReply::OnSent(const Asked& asked, Instant now) {
  if (asked.request->expect.reply == protocols::Expectation::Reply::none) return;
  const protocols::Request& request = *asked.request;
  const SentRequest sent{asked.member->place, asked.question(), now, request.is_proof(),
                         request.context};
  orders_.OnSent(*asked.member, sent);
}

/// True if the reply may answer `asked`. A reply to the request for the name must equal the stored
/// reply, or be a refusal although the device has a name. `outcome`: how the conversation has
/// judged the form of the reply.
bool WhoseReply::Fits(const Asked& asked, View frame, Outcome outcome) const {
  if (!ProvesLife(outcome)) return false;
  const Identity& identity = entries_[*asked.member].identity;
  return !identity.IsAskedBy(asked.question()) || identity.Is(frame) ||
         (identity.names() && IsRefusal(outcome));
}

/// True if the reply may answer the earlier request `sent`. Example: "<1D:SPAJ 140C:5E" answers the
/// request for the name ">1RF:CC" if it is the name of relay 1, and no request for a number.
/// "<1D:140:…" fits requests of both kinds, so it proves nothing as a name. Two Modbus registers
/// fit every read of two registers.
bool WhoseReply::MayAnswer(const SentRequest& sent, View frame, Outcome outcome) const {
  if (sent.place == SentRequest::kNobody) return false;
  const Member& asked = *roster_.everyone()[sent.place];
  const Identity& identity = entries_[asked].identity;
  if (identity.IsAskedBy(sent.bytes)) {
    return identity.Is(frame) || (identity.names() && IsRefusal(outcome));
  }
  // A request of a client: it is unknown which replies fit, so any reply may answer it.
  const Device* const device = asked.device;
  return device == nullptr || ProvesLife(device->conversation->Check(sent.bytes, frame));
}

/// True if the reply may answer `sent`, whose replies have an unknown form, because the device has
/// not answered `sent` since the port opened (row 15). False if kMostOfStrangers requests were sent
/// after `sent`, or the device does not support `sent`.
bool WhoseReply::MayLookSo(const SentRequest& sent, std::size_t before, const Member& sender,
                           View frame) const {
  const auto& everyone = roster_.everyone();
  if (before > AnswerOrder::kMostOfStrangers || sent.place >= everyone.size()) return false;
  const Member& asked = *everyone[sent.place];
  const Entry& entry = entries_[asked];
  if (!asked.IsSame(sender) || entry.identity.Is(frame)) return false;
  const auto silences = entry.silences.find(sent.bytes);
  if (silences != entry.silences.end() && silences->second >= kUnknown) return false;
  return !entry.identity.IsAskedBy(sent.bytes) && !entry.known_forms.contains(sent.bytes);
}

/// Compares the reply with the stored name of the device (rows 9 and 10 of the table at the top).
/// Returns true if another device answers in place of the member.
bool WhoseReply::NoteIdentity(const Asked& asked, View frame, Outcome outcome,
                              const AnswerOrder::MayAnswer& may_answer) {
  const protocols::Request& request = *asked.request;
  Entry& entry = entries_[*asked.member];
  if (asked.probe && ProvesLife(outcome)) {
    entry.proofless = request.is_proof() ? 0 : entry.proofless + 1;
  }
  if (request.steady && ProvesLife(outcome)) {
    if (Fits(asked, frame, outcome)) {
      entry.identity.OnSame();
    } else if (!orders_.Of(*asked.member).MayBeEarlier(may_answer) &&
               entry.identity.OnOther(frame)) {
      // If the first name came only once, and before any reading, it may have been a damaged reply.
      // So no device was replaced.
      const bool was_there = entry.identity.certain() || entry.read;
      entry.identity.Learn(asked.question(), frame, outcome);
      return was_there;
    }
  }
  if (!entry.identity.known() || entry.proofless < kProbesWithoutProof) return false;
  entry.identity = {};
  return true;
}

/// Takes the reply into account in the orders of the device and of the line (rows 3 to 8, 12 and
/// 13).
void WhoseReply::Count(const Asked& asked, bool fits, Outcome outcome,
                       const AnswerOrder::MayAnswer& may_answer) {
  // Without a proof, replies to other masters cannot be distinguished from replies to this gateway,
  // so they are not expected any longer.
  const bool nameless = asked.probe && ProvesLife(outcome) && !asked.request->is_proof();
  if (nameless) orders_.Of(*asked.member).ForgetStrangers();
  orders_.OnAnswer(*asked.member, fits, may_answer);
}

/// Stores the name from the first reply that can only answer a request for the name. Ends the wait
/// for replies to other masters (row 11).
void WhoseReply::Learn(const Asked& asked, View frame, Outcome outcome) {
  const protocols::Request& request = *asked.request;
  Entry& entry = entries_[*asked.member];
  AnswerOrder& order = orders_.Of(*asked.member);
  const bool names = request.steady && ProvesLife(outcome) && outcome != Outcome::busy;
  if (names && !entry.identity.known() && order.IsAnswerTo(asked.question())) {
    entry.identity.Learn(asked.question(), frame, outcome);
  }
  // When the port opens, up to three replies to other masters may still come. The probe was sent
  // four times, so the fourth reply answers one of the probes. If the probe asks for the name, no
  // other reply can come now. If the probe is a read of an unusual length, a rare poll may have the
  // same form, so the replies to the other three probes are still expected.
  if (entry.strangers && request.is_proof() && outcome == Outcome::ok && order.IsOfLatest()) {
    if (!request.unlike_polls || asked.member->device->conversation->Queries().empty()) {
      order.Reset();
    }
    entry.strangers = false;
  }
}

/// Stores whether the reply had an unexpected form. If it had, a proof goes before the next such
/// request. The proof shows whether the device uses this form, or an earlier reply came twice.
void WhoseReply::NoteForm(const Asked& asked, bool fits) {
  std::vector<Bytes>& odd = entries_[*asked.member].odd;
  const Bytes question = asked.question();
  const auto known = std::ranges::find(odd, question);
  if (fits && known != odd.end()) odd.erase(known);
  if (fits || asked.probe || known != odd.end()) return;
  if (odd.size() == kMostOdd) odd.erase(odd.begin());
  odd.push_back(question);
}

/// Call when the device has answered in the expected form, or has refused: it supports this
/// request.
void WhoseReply::NoteKnownForm(const Asked& asked, Outcome outcome) {
  Entry& entry = entries_[*asked.member];
  const bool identifies = entry.identity.IsAskedBy(asked.question());
  if (asked.request->is_proof() && (identifies || outcome == Outcome::ok)) entry.proves = true;
  if (outcome == Outcome::busy) return;
  entry.silences.erase(asked.question());
  if (entry.known_forms.size() >= kMostKnownForms) entry.known_forms.clear();
  entry.known_forms.insert(asked.question());
}

WhoseReply::Verdict WhoseReply::OnReply(const Asked& asked, View reply, Outcome outcome) {
  const bool proof = asked.request->is_proof();
  const Bytes frame = WithoutNumber(*asked.member->protocol, reply);
  const auto has_form = [&](const SentRequest& sent, std::size_t) {
    return MayAnswer(sent, frame, outcome);
  };
  const auto may_answer = [&](const SentRequest& sent, std::size_t before) {
    // The reply to a write repeats or acknowledges the write, so it cannot be mistaken for a
    // reading of unknown form.
    return has_form(sent, before) ||
           (!asked.writes && MayLookSo(sent, before, *asked.member, frame));
  };
  Entry& entry = entries_[*asked.member];
  Verdict verdict;
  if (outcome == Outcome::unexpected && orders_.OnReplyOfAnother(asked, has_form)) {  // row 18
    verdict.elsewhere = true;
    return verdict;
  }
  verdict.replaced = NoteIdentity(asked, frame, outcome, has_form);
  const bool fits = Fits(asked, frame, outcome);
  const bool copied = std::ranges::equal(frame, entry.proof_reply);
  verdict.odd = !fits && !asked.probe && !copied && orders_.IsBehindProof(asked);  // row 14
  verdict.shifted = !fits && !verdict.odd && orders_.Owed(asked) == 1;             // row 2
  if (fits || verdict.odd || verdict.shifted) NoteForm(asked, fits);
  if (fits && proof) entry.proof_reply.assign(frame.begin(), frame.end());
  if (verdict.odd) {
    orders_.OnOddForm(*asked.member);
  } else {
    // If the device has answered no proof since the port opened, and no reply to another master can
    // come, a reply of unknown form counts as the reply to this request.
    const SentRequest latest{asked.member->place, asked.question(), {}, proof};
    const bool odd =
        !entry.proves && !entry.strangers && MayLookSo(latest, 0, *asked.member, frame);
    Count(asked, fits || odd, outcome, may_answer);
  }
  const bool strangers = entry.strangers;
  Learn(asked, frame, outcome);
  verdict.elsewhere = !orders_.MayBeInStep(asked);
  verdict.proven = orders_.IsAnswerTo(asked);
  const int owed = orders_.Owed(asked);
  if (verdict.proven) entry.lag = proof ? owed : std::min(entry.lag, owed);
  // After the port had opened, the probe was sent four times. Replies to the other three probes may
  // be outstanding (see Learn), which is no lag of the device.
  if (strangers && !entry.strangers) entry.lag = 0;
  if (verdict.replaced) entry.known_forms.clear();
  if (verdict.proven && fits) NoteKnownForm(asked, outcome);
  if (!asked.probe && fits && orders_.Of(*asked.member).IsInStep()) entry.read = true;
  // The probe did not ask for the name. Only its name identifies a device that has one, so the
  // reply to this probe proves nothing.
  if (asked.probe && !proof && entry.identity.known()) verdict.proven = false;
  verdict.older = orders_.Older(asked);
  return verdict;
}

void WhoseReply::NoteOutcome(const Asked& asked, Outcome outcome, bool silent, Instant now) {
  // A request to a slave without a configured device that got no reply, or a damaged one, may still
  // be answered.
  Entry& entry = entries_[*asked.member];
  if (!ProvesLife(outcome) && outcome != Outcome::unexpected && asked.member->device == nullptr) {
    lost_.OnLost(*asked.member, asked.request->bytes, now);
  }
  if (silent && outcome == Outcome::no_reply) {
    entry.answered_probe = false;  // another device may be connected now
    const Bytes question = asked.question();
    if (entry.silences.size() >= kMostKnownForms) entry.silences.clear();
    const bool counts = !asked.retry && !asked.writes && !entry.known_forms.contains(question);
    if (counts) ++entry.silences[question];
  }
  if (!asked.probe || !ProvesLife(outcome)) return;
  entry.proven_at = now;
  entry.answered_probe = asked.request->is_proof() || !entry.identity.known();
}

void WhoseReply::OnOpened(const Member& member, Instant now) {
  orders_.Of(member).OnStranger(now);
  Entry& entry = entries_[member];
  entry.strangers = true;
  entry.known_forms.clear();
  entry.proves = false;
}

void WhoseReply::OnReconnect(const Member& member) {
  Entry& entry = entries_[member];
  entry.answered_probe = false;
  entry.proofless = 0;
  entry.lag = 0;
  entry.read = false;
  entry.odd.clear();
  entry.silences.clear();
}

void WhoseReply::OnNoProof(const Device& device, Instant now) {
  if (!device.conversation->Queries().empty()) return;
  orders_.Of(device).ForgetStrangers();
  orders_.ForgetBefore(device, now - std::max<Duration>(kOwedFor, 2 * device.times.ceiling));
}

void WhoseReply::OnSecondReply(const Member& member) { orders_.OnCopy(member); }

Exchange OwedReplies::ExchangeOf(const Asked& asked, bool trusted, Instant idle_since,
                                 Instant now) {
  const Member& member = *asked.member;
  const protocols::Request& request = *asked.request;
  if (idle_since + late_replies.LongestReply() <= now) readings.OnRested();
  // With `trust_order` the user declares that nothing delays replies. A first try was sent when no
  // late reply could come, so no reply can be mistaken for its own.
  if (trusted && !asked.retry) orders.Reset(member);
  Exchange exchange{request, member.protocol->reply_rule, member.times, {}, {}};
  exchange.lags = whose.Lags(member);
  exchange.times.reply += late_replies.MoreReply(asked);
  const Duration more = request.reply - exchange.times.reply;
  if (more > Duration::zero()) {
    exchange.times.reply += more;
    exchange.times.ceiling += more;
  }
  exchange.times.quiet = std::max(exchange.times.quiet, request.quiet);
  exchange.times.drain += late_replies.ExtraDrain(member);
  exchange.aftermath = late_replies.Aftermath(asked, now);
  // The replies of this device always come after a later request, so waiting does not help.
  if (exchange.lags) exchange.aftermath = std::min(exchange.aftermath, member.times.drain);
  return exchange;
}

}  // namespace baudgate::bus
