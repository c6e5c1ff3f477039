// `WhoseReply` decides to which request a reply belongs. Replies of most protocols carry no number,
// so a late reply may pass for the reply to a later request. A reply is *owed* as long as it may
// still come; a reading is good only if no owed reply could be taken for it. A device owes replies,
// and so does a serial server, which may delay all replies of the line.
// After silence, damage, a second reply or a closed port the device is first sent a *proof*: a
// probe whose reply differs from all other replies (`is_proof` in protocols/conversation.h). A
// table in whose_reply.cpp has the cases; docs/timeouts.md describes the rules.
// gateway/bus/jobs/job.cpp reports every request and every reply of the line.
// `AnswerOrder`, `ReplyOrders` and `LostReplies` keep the requests, `Identity` the name of a
// device, `LatestReadings` the latest readings. `OwedReplies` joins them with
// `LateReplies`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/replies/late_replies.h"

namespace baudgate::bus {

// `AnswerOrder` keeps the latest requests, and which of them may have been answered last. Replies
// carry no number, but they come in the order of their requests, each once:
//
//   request  what comes  then
//   ?A1      nothing     the reply to ?A1 is lost, or still owed
//   ?A2      a reply     it answers ?A2; or it answers ?A1, and the reply to ?A2 is owed
//   ?A2      a reply     in each of these cases it answers one of the two ?A2
//
// There is an order for each device, which may lag, and an order for the line, because a serial
// server in front of the line delays all replies. `WhoseReply` uses both.
struct SentRequest {
  std::size_t place = kNobody;  ///< place of the member in the roster, or a constant below
  Bytes bytes;                  ///< see Asked::question
  Instant at{};
  bool proof = false;  ///< the reply differs from the replies to all polls of the device
  Bytes context{};     ///< see protocols::Request

  static constexpr std::size_t kNobody = ~std::size_t{0};
  /// A request of another master, with unknown content.
  static constexpr std::size_t kStranger = kNobody - 1;
};

class AnswerOrder {
 public:
  /// The most replies that are counted as owed; older replies are given up.
  static constexpr std::size_t kMostOwed = 63;
  /// The most replies that may be owed to another master (a "stranger").
  static constexpr std::size_t kMostOfStrangers = 3;

  void OnSent(const SentRequest& request);
  /// Another master may have used the port: up to three replies to its requests may still come, and
  /// any reply may be one of them. There are never more than three, even if the port opens several
  /// times before a reply comes.
  void OnStranger(Instant now);
  /// Drops the requests of other masters.
  void ForgetStrangers();
  /// Returns whether the reply may answer `request`, which was sent `before` requests before the
  /// latest one.
  using MayAnswer = std::function<bool(const SentRequest&, std::size_t before)>;
  /// Takes a reply into account. `fits`: it may answer the latest request. Returns false, and
  /// changes nothing, if it answers no request that is owed a reply.
  bool OnAnswer(bool fits, const MayAnswer& may_answer);
  /// True if only the latest request, perhaps several times, was sent since a proof was answered.
  /// Then no reply is owed, and of earlier replies only the reply to the proof may come again.
  bool IsBehindProof() const;
  /// Call if IsBehindProof() and the reply answers no request: the device answers the latest
  /// request in another form, or another device has answered.
  void OnOddForm() { answered_ |= 1; }
  /// Call if the reply answers no request that is owed a reply: the order is lost. From now on any
  /// earlier request may have been answered last, until a reply fits few of them only.
  void OnLost();
  /// Returns whether the reply may answer an earlier request, even if that is not owed a reply.
  bool MayBeEarlier(const MayAnswer& may_answer) const;
  /// Call when a reply has come twice: one reply more may be owed now.
  void OnCopy();
  /// Call when no reply is owed.
  void Reset() { answered_ = 1; }
  /// Calls Reset() if the latest request was sent before `time`, so that no reply is expected any
  /// more.
  void ForgetBefore(Instant time) {
    if (SentBefore(0).at < time) Reset();
  }

  /// Returns how many of the latest requests may still be answered.
  std::size_t Owed() const { return static_cast<std::size_t>(std::bit_width(answered_)) - 1; }
  /// Returns whether `is_one` accepts a request that is owed a reply.
  bool Owes(const std::function<bool(const SentRequest&)>& is_one) const;
  /// Returns whether `is_one` accepts one of the remembered requests, owed a reply or not.
  bool Remembers(const MayAnswer& is_one) const;
  /// True if no reply is owed: the latest request was answered last.
  bool IsInStep() const { return answered_ == 1; }
  bool MayBeInStep() const { return (answered_ & 1U) != 0; }
  /// True if an owed reply would be recognised, whichever request is sent next: all requests that
  /// are owed a reply are proofs.
  bool IsSafe() const;
  /// Returns whether the latest reply certainly answers `request`, the bytes of the latest request:
  /// all requests that it may answer have these bytes and one context.
  bool IsAnswerTo(const Bytes& request) const;
  /// True if the latest reply can only answer the latest request, or requests with the same bytes
  /// directly before it.
  bool IsOfLatest() const;
  /// Returns the time between the oldest request that the reply may answer and the latest request.
  Duration Older() const { return SentBefore(0).at - SentBefore(Owed()).at; }

 private:
  std::uint64_t Fitting(std::size_t nearest, std::size_t end, const MayAnswer& may_answer) const;
  const SentRequest& SentBefore(std::size_t requests) const {
    return sent_[(count_ - requests) % sent_.size()];
  }
  /// Returns whether the request `lag` before the latest asks the same as the latest.
  bool IsSame(std::size_t lag) const {
    const SentRequest& latest = SentBefore(0);
    return SentBefore(lag).bytes == latest.bytes && SentBefore(lag).context == latest.context;
  }

  std::array<SentRequest, kMostOwed + 1> sent_{};
  std::size_t count_ = kMostOwed;  // number of requests; the latest is sent_[count_ % size]
  // Bit n: the request n before the latest may have been answered last.
  std::uint64_t answered_ = 1;
};

// `ReplyOrders` contains the order of each device, and the order of all requests of the line,
// because a serial server in front of the line delays all replies. A reply that carries the address
// of its device cannot be a reply that the server owes for another device. So for a request with
// such a reply only the order of its device counts.
class ReplyOrders {
 public:
  explicit ReplyOrders(const Roster& roster) : roster_(roster) {}

  /// Stores the address in the replies of the member, which its first request gives. Entries with
  /// one address are one device on the wire, and share one order.
  void Recognise(Member& member, const Bytes& sender) {
    if (!member.sender.empty() || sender.empty()) return;
    member.sender = sender;
    for (const Member* other : roster_.everyone()) {
      if (other == &member || !member.IsSame(*other)) continue;
      devices_[member].first = FirstOf(*other);
      return;
    }
  }

  AnswerOrder& Of(const Member& member) { return devices_.At(FirstOf(member)).order; }
  const AnswerOrder& Of(const Member& member) const { return devices_.At(FirstOf(member)).order; }

  void OnSent(const Member& member, const SentRequest& request) {
    Of(member).OnSent(request);
    line_.OnSent(request);
  }
  /// Takes a reply to the latest request into account. `fits`: see AnswerOrder::OnAnswer.
  void OnAnswer(const Member& member, bool fits, const AnswerOrder::MayAnswer& may_answer) {
    const bool own = Of(member).OnAnswer(fits, may_answer);
    const bool known = line_.OnAnswer(fits, may_answer);
    if (!known) line_.OnLost();
    if (!own && !known) Of(member).OnLost();
  }
  /// The reply does not answer `asked`. Returns true if it answers a request to another device, and
  /// replies carry addresses. Then `asked.member` still owes the same number of replies.
  bool OnReplyOfAnother(const Asked& asked, const AnswerOrder::MayAnswer& may_answer) {
    const auto& everyone = roster_.everyone();
    const bool another = line_.Remembers([&](const SentRequest& sent, std::size_t before) {
      return sent.place < everyone.size() && !everyone[sent.place]->IsSame(*asked.member) &&
             may_answer(sent, before);
    });
    if (!asked.names_itself() || !another) return false;
    if (!line_.OnAnswer(false, may_answer)) line_.OnLost();
    return true;
  }
  bool IsBehindProof(const Asked& asked) const {
    return Of(*asked.member).IsBehindProof() && (asked.names_itself() || line_.IsBehindProof());
  }
  void OnOddForm(const Member& member) {
    Of(member).OnOddForm();
    line_.OnOddForm();
  }
  void OnCopy(const Member& member) {
    Of(member).OnCopy();
    line_.OnCopy();
  }
  void ForgetBefore(const Member& member, Instant time) {
    Of(member).ForgetBefore(time);
    line_.ForgetBefore(time);
  }
  /// Call when neither the member nor the server owes a reply.
  void Reset(const Member& member) {
    Of(member).Reset();
    line_.Reset();
  }

  bool MayBeInStep(const Asked& asked) const {
    return Of(*asked.member).MayBeInStep() && (asked.names_itself() || line_.MayBeInStep());
  }
  /// Returns whether the latest reply answers `asked` or a repetition, and no request of an earlier
  /// task.
  bool IsOfLatest(const Asked& asked) const {
    return Of(*asked.member).IsOfLatest() && (asked.names_itself() || line_.IsOfLatest());
  }
  /// Returns whether the latest reply answers `asked`, or an earlier request with the same bytes.
  bool IsAnswerTo(const Asked& asked) const {
    const Bytes question = asked.question();
    return Of(*asked.member).IsAnswerTo(question) &&
           (asked.names_itself() || line_.IsAnswerTo(question));
  }
  bool IsSafe(const Asked& asked) const {
    return Of(*asked.member).IsSafe() && (asked.names_itself() || line_.IsSafe());
  }
  /// Returns how many replies may still come. Before OnSent these are replies to earlier requests;
  /// after it the reply to `asked` is included.
  int Owed(const Asked& asked) const {
    const std::size_t own = Of(*asked.member).Owed();
    return static_cast<int>(asked.names_itself() ? own : std::max(own, line_.Owed()));
  }
  /// Returns whether another device of the line may owe a reply that comes before the reply to
  /// `asked`. A comparison of the two Owed() counts cannot show this: a reply that comes while
  /// another device is asked is not subtracted from the replies that its own device owes.
  bool OthersOwe(const Asked& asked) const {
    return line_.Owes([&](const SentRequest& sent) {
      const auto& everyone = roster_.everyone();
      return sent.place < everyone.size() && !everyone[sent.place]->IsSame(*asked.member);
    });
  }
  Duration Older(const Asked& asked) const {
    const Duration own = Of(*asked.member).Older();
    return asked.names_itself() ? own : std::max(own, line_.Older());
  }

 private:
  static constexpr std::size_t kSelf = static_cast<std::size_t>(-1);
  struct Entry {
    AnswerOrder order;
    // Place of the first entry with the same address, whose order counts.
    std::size_t first = kSelf;
  };

  std::size_t FirstOf(const Member& member) const {
    const std::size_t first = devices_[member].first;
    return first == kSelf ? member.place : first;
  }

  const Roster& roster_;
  ByMember<Entry> devices_;
  AnswerOrder line_;  // order of all requests of the line
};

// `LostReplies` keeps requests to slaves that only routes reach and that got no reply. There is no
// AnswerOrder for these slaves, so a reply that was only late may be taken for the reply to the
// next request. `WhoseReply` uses it; docs/timeouts.md, "Requests of transparent routes".
class LostReplies {
 public:
  /// Which earlier, lost requests a reply may answer in place of the present request.
  struct Older {
    bool other = false;  ///< a lost request with other bytes
    bool same = false;   ///< a lost request with the same bytes
  };

  /// `request` got no reply, or a damaged reply.
  void OnLost(const Member& slave, const Bytes& request, Instant now);
  /// Returns whether a reply to a lost request may still come for a request that was sent at
  /// `began`.
  bool MayCome(const Member& slave, Instant began) const;
  /// Returns which lost requests a reply could answer. `fits` returns whether the reply could
  /// answer the given request.
  using MayFit = std::function<bool(const Bytes& request)>;
  Older MayBe(const Member& slave, const Bytes& request, Instant began, const MayFit& fits) const;
  /// A reply came: the `count`-th reply in a row to the same request. Returns false if it may
  /// belong to an earlier request. Example: two replies were lost, so the third reply to one
  /// request must be its own.
  bool OnReply(const Member& slave, const Bytes& request, Older older, std::size_t count);

 private:
  struct Entry {
    std::optional<Instant> lost_at;  // when the latest reply was lost
    std::vector<Bytes> requests;     // the latest lost requests
  };
  /// The gateway assumes that no slave takes longer for a reply. A slave with a longer ceiling is
  /// guarded for these 5 s only. Needed by
  /// PollerRoutedFaults.ALateReplyOfAnotherLengthIsNotAcceptedAsAnOddReply.
  static constexpr Duration kLatest = 5s;
  static constexpr std::size_t kMost = 8;

  ByMember<Entry> entries_;
};

// `Identity` keeps the reply of a device to the request that identifies it. Used by `WhoseReply`.
class Identity {
 public:
  bool known() const { return !reply_.empty(); }
  /// True if the reply contains a name; false if the device refuses to give its name.
  bool names() const { return known() && names_; }
  /// Returns whether `request` is the request that identifies the device.
  bool IsAskedBy(const Bytes& request) const { return known() && request == request_; }
  /// Returns whether `reply` is the known reply to the identifying request.
  bool Is(View reply) const;

  /// Stores the request and its reply. The reply must be certain to answer this request.
  void Learn(const Bytes& request, View reply, Outcome outcome);
  /// The identifying request was answered with the known reply.
  void OnSame() {
    other_.clear();
    certain_ = true;
  }
  /// True if the known reply has come more than once.
  bool certain() const { return certain_; }
  /// The identifying request was answered with another reply. Returns true if the same other reply
  /// came the last time as well. If it came once it may be damage, because not all replies have a
  /// check value.
  bool OnOther(View reply);

 private:
  Bytes request_;
  Bytes reply_;
  Bytes other_;  // came last in place of reply_
  bool names_ = false;
  bool certain_ = false;
};

class WhoseReply {
 public:
  /// `orders`: the replies that devices and the line still owe. Both references must stay valid for
  /// the lifetime of this object.
  WhoseReply(const Roster& roster, ReplyOrders& orders) : roster_(roster), orders_(orders) {}

  /// See ReplyOrders.
  void Recognise(Member& member, const Bytes& sender) { orders_.Recognise(member, sender); }
  bool MayBeInStep(const Asked& asked) const { return orders_.MayBeInStep(asked); }
  bool IsOfLatest(const Asked& asked) const { return orders_.IsOfLatest(asked); }
  /// Call when the reply to `asked` was the reply to another request. Returns how many replies may
  /// come before its own. `of_sender`: the reply came from the device that was asked.
  int RepliesBefore(const Asked& asked, bool of_sender) const {
    const bool nearer = of_sender || !asked.names_itself() || orders_.OthersOwe(asked);
    return nearer ? orders_.Owed(asked) : 0;
  }
  /// Returns whether waiting brings no further reply of the member: it owes none, or it always lags
  /// by some replies.
  bool IsSettled(const Member& member) const {
    return Lags(member) || orders_.Of(member).IsInStep();
  }
  /// Call before the first request of a task. Returns true if a reply to an earlier request could
  /// be taken for the reply to this one, or if it is unknown which device answers.
  bool NeedsProbeFirst(const Asked& asked, Instant now) const;
  /// True if the device has no points to read and has never answered a probe. Example: a relay card
  /// that does not know function 08. Its writes are sent without a probe, and a write that is
  /// answered shows that the card is there.
  bool IsProbedByWrites(const Device& device) const;
  /// Returns until when the latest proof of the member holds. ProofRenews returns from when on it
  /// may be renewed.
  Instant ProofEnds(const Member& member) const {
    return entries_[member].answered_probe ? entries_[member].proven_at + kProofHolds : Instant{};
  }
  Instant ProofRenews(const Member& member) const {
    return entries_[member].proven_at + kProofRenews;
  }
  /// Returns whether a reply of an unexpected form is accepted, because no other reply is owed.
  bool MayBeOdd(const Asked& asked) const {
    return entries_[*asked.member].read && orders_.Owed(asked) == 1;
  }
  /// Returns whether replies were still owed when the order of the member was last proven.
  bool Lags(const Member& member) const { return entries_[member].lag > 0; }
  /// Returns whether only the reply to this request of a client can come. For a slave that only
  /// routes reach there is no order: it owes nothing if all its latest requests were answered.
  bool IsOwedAlone(const Asked& asked) const;
  /// Returns which lost requests to a slave that only routes reach a reply could answer: see
  /// LostReplies.
  LostReplies::Older MayBeLost(const Asked& asked, const LostReplies::MayFit& fits) const {
    return lost_.MayBe(*asked.member, asked.request->bytes, asked.sent, fits);
  }
  /// A reply of a slave that only routes reach has come. Returns false if it may belong to an
  /// earlier request.
  bool OnRoutedReply(const Asked& asked, LostReplies::Older older, std::size_t count) {
    return lost_.OnReply(*asked.member, asked.request->bytes, older, count);
  }
  /// True if the device reports its name, so that another device in its place would be noticed.
  bool HasName(const Member& member) const { return entries_[member].identity.names(); }

  void OnSent(const Asked& asked, Instant now);

  struct Verdict {
    bool elsewhere = false;  ///< the reply belongs to another request
    bool proven = true;  ///< the reply belongs to this request, or an earlier one of the same bytes
    Duration older{};    ///< the request that the reply may answer was sent at most so much earlier
    bool replaced = false;  ///< another device answers in its place
    /// No reply was owed and this one does not fit: an earlier reply came twice.
    bool shifted = false;
    bool odd = false;  ///< the reply does not fit, and is no copy of an earlier reply
  };
  /// Judges a reply of the member itself. `outcome` is what the conversation or the carrier
  /// returned for its form.
  Verdict OnReply(const Asked& asked, View reply, Outcome outcome);
  /// Call at the end of each exchange. `silent`: a reply was expected, and the port stayed open.
  void NoteOutcome(const Asked& asked, Outcome outcome, bool silent, Instant now);
  /// Call when the port has opened. Another master may have asked the member: this program before
  /// its last start, or a program to which the port was lent. A server that lags may still deliver
  /// replies to these requests.
  void OnOpened(const Member& member, Instant now);
  /// Call when another device may be connected.
  void OnReconnect(const Member& member);

  /// Call if a proof is needed, and the device cannot be probed. A read goes out without a proof
  /// and is repeated until its reply must be its own; a write cannot be repeated. So if the device
  /// has no reads, replies to another master count as lost, and replies to requests of this gateway
  /// some time after the latest request (kOwedFor). Until then a reply that may answer an earlier
  /// request confirms no write.
  void OnNoProof(const Device& device, Instant now);

  /// Call when a second, different reply came: one of the two belongs to another request.
  void OnSecondReply(const Member& member);

 private:
  struct Entry {
    Identity identity;
    bool answered_probe = false;
    bool strangers = false;  // replies to other masters may be owed, since OnOpened
    bool read = false;       // a poll was answered in order and in its form, since OnReconnect
    int lag = 0;             // number of replies owed when the order was last proven
    Instant proven_at{};     // when a probe was answered last
    int proofless = 0;       // number of answered probes in a row that were no proofs
    Bytes proof_reply;
    std::vector<Bytes> odd;  // requests whose latest replies had an unexpected form
    // Requests that were answered in the expected form, since OnOpened.
    std::set<Bytes> known_forms;
    bool proves = false;  // one of known_forms is a proof
    // Requests that were not answered since OnReconnect, each with its number of tasks that met
    // silence.
    std::map<Bytes, int> silences;
  };
  /// More than the probes after which an identification that is never answered is given up
  /// (protocols/common/identification.h).
  static constexpr int kProbesWithoutProof = 8;
  /// How long a proof holds. Only a new probe reveals a device whose replies are one ahead because
  /// a reply came twice, or a device that was replaced unnoticed.
  static constexpr Duration kProofHolds = 1min;
  static constexpr Duration kProofRenews = 45s;
  /// Both for each device.
  static constexpr std::size_t kMostOdd = 16;
  static constexpr std::size_t kMostKnownForms = 256;
  /// A device that did not answer this many tasks with the same request counts as not supporting
  /// that request, so it owes no reply to it.
  static constexpr int kUnknown = 3;
  /// How long a device without reads owes a reply that no proof can show to be lost; at least twice
  /// its ceiling.
  static constexpr Duration kOwedFor = 10s;

  /// True if the device answers probes, but none of them is a proof. After a disturbance nothing
  /// shows to which request its replies belong.
  bool IsUnprovable(const Member& member) const {
    return entries_[member].proofless >= kProbesWithoutProof;
  }
  /// Returns whether another reply in place of the awaited one would be noticed.
  bool IsSafe(const Asked& asked) const;
  bool Fits(const Asked& asked, View frame, Outcome outcome) const;
  bool MayAnswer(const SentRequest& sent, View frame, Outcome outcome) const;
  bool MayLookSo(const SentRequest& sent, std::size_t before, const Member& sender,
                 View frame) const;
  bool NoteIdentity(const Asked& asked, View frame, Outcome outcome,
                    const AnswerOrder::MayAnswer& may_answer);
  void Count(const Asked& asked, bool fits, Outcome outcome,
             const AnswerOrder::MayAnswer& may_answer);
  void Learn(const Asked& asked, View frame, Outcome outcome);
  void NoteForm(const Asked& asked, bool fits);
  void NoteKnownForm(const Asked& asked, Outcome outcome);

  const Roster& roster_;
  ReplyOrders& orders_;
  ByMember<Entry> entries_;
  LostReplies lost_;
};

// `LatestReadings` contains the points that were read and stored since the line last rested for its
// longest reply time. If a reply comes twice, one of these readings belongs to another request, and
// it is unknown which.
class LatestReadings {
 public:
  struct Points {
    std::size_t device = 0;  ///< place of the device in the roster
    std::vector<std::size_t> points{};
    bool operator==(const Points&) const = default;
  };

  void OnStored(Points read) {
    if (std::ranges::find(read_, read) == read_.end()) read_.push_back(std::move(read));
  }
  /// The line has rested, so no reply to an earlier request is owed any more.
  void OnRested() { read_.clear(); }
  std::vector<Points> TakeAll() { return std::exchange(read_, {}); }

 private:
  std::vector<Points> read_;
};

// `OwedReplies` joins all parts about replies that may still come: until when they may come
// (late_replies.h), to which request they belong, and which readings are in doubt if a reply came
// twice.
struct OwedReplies {
  /// `roster` must stay valid for the lifetime of this object.
  explicit OwedReplies(const Roster& roster)
      : late_replies(roster), orders(roster), whose(roster, orders) {}

  /// Returns the exchange for a request that is given to the line now, with longer times if replies
  /// are owed. `trusted`: the device has the option `trust_order`; `idle_since`: since when the
  /// line is idle.
  Exchange ExchangeOf(const Asked& asked, bool trusted, Instant idle_since, Instant now);

  /// Call at the end of an exchange. `broadcast`: no reply was expected.
  void OnEnded(const Asked& asked, const ExchangeEnd& end, bool broadcast, Instant now) {
    late_replies.OnEnded(asked, end, whose.IsSettled(*asked.member), now);
    const bool silent = end.outcome != Outcome::line_down && !broadcast;
    whose.NoteOutcome(asked, end.outcome, silent, now);
  }

  LateReplies late_replies;
  ReplyOrders orders;
  WhoseReply whose;
  LatestReadings readings;
};

}  // namespace baudgate::bus
