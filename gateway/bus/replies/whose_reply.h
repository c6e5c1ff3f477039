// `WhoseReply` decides which request a reply answers. Replies of most protocols carry no number, so
// a late reply can be mistaken for the reply to a later request. A reply is *owed* as long as it
// may still come; a reading is good only if it cannot come from a pending reply to another request.
// Replies can be late in a device, and in a serial server, which may delay all replies of the line.
// After silence, damage, a second reply or a closed port the device must first answer a *proof*: a
// probe whose reply differs from all other replies (Request::is_proof in protocols/conversation.h).
// gateway/bus/replies/whose_reply.cpp has the table of the cases, docs/timeouts.md the rules.
// gateway/bus/jobs/job.cpp reports every request and every reply of the line. The other classes:
//
//   AnswerOrder      the latest requests, and which of them may have been answered last
//   ReplyOrders      an AnswerOrder for each device, and one for the line
//   LostReplies      unanswered requests to slaves without configuration
//   Identity         the name of a device
//   LatestReadings   the readings that a second reply makes uncertain
//   OwedReplies      all of these classes, and `LateReplies`
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

// `AnswerOrder` stores the latest requests, and which of them may have been answered last. Replies
// carry no number, but come in the order of their requests, each once. Example:
//
//   request  what comes  then
//   ?A1      nothing     the reply to ?A1 is lost, or still owed
//   ?A2      a reply     it answers ?A2; or it answers ?A1, and the reply to ?A2 is owed
//   ?A2      a reply     in both cases it answers one of the two ?A2
//
// There is an order for each device, whose replies may lag, and one for the line, because a serial
// server in front of the line can delay all replies. `WhoseReply` uses both.
struct SentRequest {
  std::size_t place = kNobody;  ///< index of the asked member in the roster; or kNobody, kStranger
  Bytes bytes;                  ///< the request without its sequence number (Asked::question)
  Instant at{};
  bool proof = false;  ///< the reply to this request differs from the replies to all polls
  Bytes context{};     ///< see protocols::Request::context

  static constexpr std::size_t kNobody = ~std::size_t{0};
  /// A request of another master, with unknown content.
  static constexpr std::size_t kStranger = kNobody - 1;
};

class AnswerOrder {
 public:
  /// Greatest number of replies that may still come. If there are more, the oldest are given up.
  static constexpr std::size_t kMostOwed = 63;
  /// Greatest number of replies that may still come to requests of another master (a "stranger").
  static constexpr std::size_t kMostOfStrangers = 3;

  void OnSent(const SentRequest& request);
  /// Call when another master may have used the port: up to kMostOfStrangers replies to its
  /// requests may still come, and any reply may be one of them. Does nothing if these replies are
  /// expected already.
  void OnStranger(Instant now);
  void ForgetStrangers();
  /// Returns true if the reply that came may answer `request`. `before`: how many requests before
  /// the latest one it was sent.
  using MayAnswer = std::function<bool(const SentRequest&, std::size_t before)>;
  /// Takes a reply into account. `fits`: the reply may answer the latest request. Returns false,
  /// and changes nothing, if the reply answers no request that is still without a reply.
  bool OnAnswer(bool fits, const MayAnswer& may_answer);
  /// True if a proof was answered directly before the latest request, which may have been repeated.
  /// Then no other wrong reply can come than a copy of the reply to the proof.
  bool IsBehindProof() const;
  /// Call if IsBehindProof() and the reply answers no request: the device answers the latest
  /// request in an unexpected form, or another device has answered. The reply counts as the reply
  /// to the latest request.
  void OnOddForm() { answered_ |= 1; }
  /// Call when a reply answers no request that is still without a reply. The order is lost: any
  /// earlier request may have been answered last, until a later reply fits only few of them.
  void OnLost();
  /// True if the reply may answer any stored earlier request, whether its reply has come or not.
  bool MayBeEarlier(const MayAnswer& may_answer) const;
  /// Call when a reply has come twice: one reply more may still come.
  void OnCopy();
  /// Call when no reply can come any more. The latest request counts as answered.
  void Reset() { answered_ = 1; }
  /// Calls Reset() if the latest request was sent before `time`, so that no reply is expected.
  void ForgetBefore(Instant time) {
    if (SentBefore(0).at < time) Reset();
  }

  /// Returns how many of the latest requests may still be answered.
  std::size_t Owed() const { return static_cast<std::size_t>(std::bit_width(answered_)) - 1; }
  bool Owes(const std::function<bool(const SentRequest&)>& is_one) const;
  bool Remembers(const MayAnswer& is_one) const;
  /// True if no reply can come any more: the latest request was answered last.
  bool IsInStep() const { return answered_ == 1; }
  bool MayBeInStep() const { return (answered_ & 1U) != 0; }
  /// True if all replies that may still come are replies to proofs. They would be recognised,
  /// whichever request is sent next.
  bool IsSafe() const;
  /// True if the latest reply certainly answers a request with these bytes. `request`: the bytes of
  /// the latest request. All requests that the reply may answer must have these bytes, and the
  /// context of the latest request.
  bool IsAnswerTo(const Bytes& request) const;
  /// True if the latest reply answers the latest request, or an equal request sent directly before
  /// it.
  bool IsOfLatest() const;
  /// Returns the time from the oldest request that the latest reply may answer to the latest
  /// request.
  Duration Older() const { return SentBefore(0).at - SentBefore(Owed()).at; }

 private:
  std::uint64_t Fitting(std::size_t nearest, std::size_t end, const MayAnswer& may_answer) const;
  const SentRequest& SentBefore(std::size_t requests) const {
    return sent_[(count_ - requests) % sent_.size()];
  }
  bool IsSame(std::size_t lag) const {
    const SentRequest& latest = SentBefore(0);
    return SentBefore(lag).bytes == latest.bytes && SentBefore(lag).context == latest.context;
  }

  std::array<SentRequest, kMostOwed + 1> sent_{};
  std::size_t count_ = kMostOwed;  // number of requests so far; the latest is sent_[count_ % size]
  // Bit n is set if the request sent n requests before the latest one may have been answered last.
  std::uint64_t answered_ = 1;
};

// `ReplyOrders` contains an order of requests (AnswerOrder) for each device, and one for the whole
// line, because a serial server in front of the line can delay all replies. If a reply carries the
// address of its device, it cannot be a delayed reply of another device, so only the order of the
// device counts.
class ReplyOrders {
 public:
  explicit ReplyOrders(const Roster& roster) : roster_(roster) {}

  /// Stores `sender`, the address in the replies of the member, when the member is first asked.
  /// Members with equal addresses are one device on the wire, and share one order.
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
  /// Takes a reply to the latest request into account. `fits`: the reply may answer this request.
  void OnAnswer(const Member& member, bool fits, const AnswerOrder::MayAnswer& may_answer) {
    const bool own = Of(member).OnAnswer(fits, may_answer);
    const bool known = line_.OnAnswer(fits, may_answer);
    if (!known) line_.OnLost();
    if (!own && !known) Of(member).OnLost();
  }
  /// Call when the reply does not answer `asked`. Returns true if it answers a request to another
  /// device, which is certain only if replies carry addresses. The AnswerOrder of `asked.member`
  /// does not change.
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
  /// Call when no pending reply can come any more, neither from the member nor from a serial server
  /// in front of the line.
  void Reset(const Member& member) {
    Of(member).Reset();
    line_.Reset();
  }

  bool MayBeInStep(const Asked& asked) const {
    return Of(*asked.member).MayBeInStep() && (asked.names_itself() || line_.MayBeInStep());
  }
  /// True if the latest reply answers `asked` or an earlier try of `asked`, not a request of an
  /// earlier task.
  bool IsOfLatest(const Asked& asked) const {
    return Of(*asked.member).IsOfLatest() && (asked.names_itself() || line_.IsOfLatest());
  }
  /// True if the latest reply answers `asked`, or an earlier request with the same bytes.
  bool IsAnswerTo(const Asked& asked) const {
    const Bytes question = asked.question();
    return Of(*asked.member).IsAnswerTo(question) &&
           (asked.names_itself() || line_.IsAnswerTo(question));
  }
  bool IsSafe(const Asked& asked) const {
    return Of(*asked.member).IsSafe() && (asked.names_itself() || line_.IsSafe());
  }
  /// Returns how many replies may still come. After OnSent the reply to `asked` is one of them.
  int Owed(const Asked& asked) const {
    const std::size_t own = Of(*asked.member).Owed();
    return static_cast<int>(asked.names_itself() ? own : std::max(own, line_.Owed()));
  }
  /// True if another device of the line may send a reply before the reply to `asked` comes. The two
  /// Owed() counts cannot show this: a reply that comes while another device is asked is not
  /// subtracted from the count of its own device.
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
    // Roster index of the first member with the same address; the order of that member is used for
    // all.
    std::size_t first = kSelf;
  };

  std::size_t FirstOf(const Member& member) const {
    const std::size_t first = devices_[member].first;
    return first == kSelf ? member.place : first;
  }

  const Roster& roster_;
  ByMember<Entry> devices_;
  AnswerOrder line_;
};

// `LostReplies` stores requests that got no reply from slaves without configuration, which only
// clients of transparent routes ask. There is no AnswerOrder for these slaves, so a late reply
// could be mistaken for the reply to the next request. See docs/timeouts.md, "Requests of
// transparent routes".
class LostReplies {
 public:
  /// The requests without a reply that a reply may answer in place of the present request.
  struct Older {
    bool other = false;  ///< a request with other bytes
    bool same = false;   ///< a request with the same bytes as the present one
  };

  /// Call when `request` got no reply, or a damaged one.
  void OnLost(const Member& slave, const Bytes& request, Instant now);
  /// True if a late reply to a stored request can come in place of the reply to a request that was
  /// sent at `began`.
  bool MayCome(const Member& slave, Instant began) const;
  /// Returns which stored requests a reply could answer. `fits` returns true if the reply could
  /// answer the given request.
  using MayFit = std::function<bool(const Bytes& request)>;
  Older MayBe(const Member& slave, const Bytes& request, Instant began, const MayFit& fits) const;
  /// Call when a reply to `request` has come, the `count`-th reply in a row. Returns true if it
  /// certainly answers `request`. Example: two requests got no reply, so the third reply to
  /// repetitions of one request answers this request.
  bool OnReply(const Member& slave, const Bytes& request, Older older, std::size_t count);

 private:
  struct Entry {
    std::optional<Instant> lost_at;  // when the latest exchange without a reply ended
    std::vector<Bytes> requests;
  };
  /// No slave is expected to take longer for a reply, even if LineTimes::ceiling is longer. Needed
  /// by PollerRoutedFaults.ALateReplyOfAnotherLengthIsNotAcceptedAsAnOddReply.
  static constexpr Duration kLatest = 5s;
  static constexpr std::size_t kMost = 8;

  ByMember<Entry> entries_;
};

// `Identity` stores the reply of a device to the request that asks for its name. `WhoseReply` uses
// it to notice that another device answers.
class Identity {
 public:
  bool known() const { return !reply_.empty(); }
  /// True if the stored reply contains a name; false if the device refuses to give its name.
  bool names() const { return known() && names_; }
  bool IsAskedBy(const Bytes& request) const { return known() && request == request_; }
  /// True if `reply` equals the stored reply with the name.
  bool Is(View reply) const;

  /// Stores the request for the name and its reply. The reply must certainly answer this request.
  void Learn(const Bytes& request, View reply, Outcome outcome);
  /// Call when the request for the name was answered with the stored reply.
  void OnSame() {
    other_.clear();
    certain_ = true;
  }
  /// True if the stored reply has come more than once.
  bool certain() const { return certain_; }
  /// Call when the request for the name got another reply than the stored one. Returns true if the
  /// previous call got the same reply. A single deviating reply may be damage, because not all
  /// replies have a checksum.
  bool OnOther(View reply);

 private:
  Bytes request_;
  Bytes reply_;
  Bytes other_;
  bool names_ = false;
  bool certain_ = false;
};

class WhoseReply {
 public:
  /// `roster` and `orders` must stay valid for the lifetime of this object.
  WhoseReply(const Roster& roster, ReplyOrders& orders) : roster_(roster), orders_(orders) {}

  void Recognise(Member& member, const Bytes& sender) { orders_.Recognise(member, sender); }
  bool MayBeInStep(const Asked& asked) const { return orders_.MayBeInStep(asked); }
  bool IsOfLatest(const Asked& asked) const { return orders_.IsOfLatest(asked); }
  /// Call when the reply to `asked` answered another request. Returns how many further replies to
  /// other requests may come before the reply to `asked`. `of_sender`: the reply came from the
  /// asked device.
  int RepliesBefore(const Asked& asked, bool of_sender) const {
    const bool nearer = of_sender || !asked.names_itself() || orders_.OthersOwe(asked);
    return nearer ? orders_.Owed(asked) : 0;
  }
  /// True if it is useless to wait for a further reply of the member: none can come, or the replies
  /// always come some requests late.
  bool IsSettled(const Member& member) const {
    return Lags(member) || orders_.Of(member).IsInStep();
  }
  /// Call before the first request of a task. Returns true if the device has to be probed first: a
  /// reply to an earlier request could be mistaken for the reply to `asked`, or it is not certain
  /// which device answers.
  bool NeedsProbeFirst(const Asked& asked, Instant now) const;
  /// True if the device has no points to read and has never answered a proof (a probe whose reply
  /// differs from all other replies). Example: a relay card that does not support Modbus function
  /// 08. Writes are then sent without a probe; an answered write shows that the card is there.
  bool IsProbedByWrites(const Device& device) const;
  /// A proof is a probe whose reply differs from all other replies. ProofEnds returns until when
  /// the latest proof of the member is valid; ProofRenews returns from when on it can be renewed.
  Instant ProofEnds(const Member& member) const {
    return entries_[member].answered_probe ? entries_[member].proven_at + kProofHolds : Instant{};
  }
  Instant ProofRenews(const Member& member) const {
    return entries_[member].proven_at + kProofRenews;
  }
  /// True if a reply of an unexpected form is accepted: only the reply to `asked` can come, and the
  /// device has answered a poll in the expected form before.
  bool MayBeOdd(const Asked& asked) const {
    return entries_[*asked.member].read && orders_.Owed(asked) == 1;
  }
  /// True if the replies of the member come some requests late, as its latest proof has shown.
  bool Lags(const Member& member) const { return entries_[member].lag > 0; }
  /// True if only the reply to this request of a client can come. For a slave without
  /// configuration: each of its requests of the last 5 s was answered (LostReplies).
  bool IsOwedAlone(const Asked& asked) const;
  /// For a slave without configuration: returns which unanswered requests this reply could answer.
  LostReplies::Older MayBeLost(const Asked& asked, const LostReplies::MayFit& fits) const {
    return lost_.MayBe(*asked.member, asked.request->bytes, asked.sent, fits);
  }
  /// Call when a slave without configuration has answered. Returns false if the reply may answer an
  /// earlier request.
  bool OnRoutedReply(const Asked& asked, LostReplies::Older older, std::size_t count) {
    return lost_.OnReply(*asked.member, asked.request->bytes, older, count);
  }
  bool HasName(const Member& member) const { return entries_[member].identity.names(); }

  void OnSent(const Asked& asked, Instant now);

  struct Verdict {
    bool elsewhere = false;  ///< the reply belongs to another request
    /// The reply belongs to this request, or to an earlier request with the same bytes.
    bool proven = true;
    /// Greatest age of the reply: the time from the oldest request that it may answer to this
    /// request.
    Duration older{};
    bool replaced = false;  ///< another device answers in place of the member
    /// The reply does not fit, and no other reply could come, so an earlier reply must have come
    /// twice.
    bool shifted = false;
    bool odd = false;  ///< the reply has an unexpected form, and is no copy of an earlier reply
  };
  /// Decides which request a reply of the asked member answers. `outcome`: how the conversation or
  /// the carrier of the protocol has judged the form of the reply.
  Verdict OnReply(const Asked& asked, View reply, Outcome outcome);
  /// Call at the end of each exchange. `silent`: a reply was expected, and the port was open.
  void NoteOutcome(const Asked& asked, Outcome outcome, bool silent, Instant now);
  /// Call when the port has opened. Replies may still come to another master: this program before
  /// its restart, or a program that had borrowed the port.
  void OnOpened(const Member& member, Instant now);
  /// Call when another device may have been connected in place of the member.
  void OnReconnect(const Member& member);

  /// Call if a proof is needed, but the device cannot be probed. A read needs no proof, because it
  /// is repeated until its reply must be its own. A write cannot be repeated. So for a device that
  /// is never polled, replies to other masters are no longer expected, and replies to own requests
  /// only for some time after the latest request (kOwedFor). During this time, a reply that may
  /// answer an earlier request confirms no write.
  void OnNoProof(const Device& device, Instant now);

  /// Call when a second, different reply came: one of the two replies belongs to another request.
  void OnSecondReply(const Member& member);

 private:
  struct Entry {
    Identity identity;
    bool answered_probe = false;
    bool strangers = false;  // since OnOpened, replies to other masters may still come
    bool read = false;  // since OnReconnect, a poll was answered in order and in the expected form
    int lag = 0;        // number of replies that could still come when a proof was last answered
    Instant proven_at{};  // when a probe was answered last
    int proofless = 0;    // answered probes in a row that were no proofs
    Bytes proof_reply;
    std::vector<Bytes> odd;  // requests whose latest replies had an unexpected form
    // Requests that were answered in the expected form, since OnOpened.
    std::set<Bytes> known_forms;
    bool proves = false;  // one of known_forms is a proof
    // Reads without an answer since OnReconnect, each with the number of tasks that it has failed.
    std::map<Bytes, int> silences;
  };
  /// After this many answered probes in a row that were no proofs, the device counts as unprovable.
  /// The number is greater than the number of probes after which an unanswered request for the name
  /// is given up (protocols/common/identification.h).
  static constexpr int kProbesWithoutProof = 8;
  /// How long a proof is valid. Only a new probe reveals that a device was replaced, or that its
  /// replies come one request early because a reply came twice.
  static constexpr Duration kProofHolds = 1min;
  static constexpr Duration kProofRenews = 45s;
  static constexpr std::size_t kMostOdd = 16;
  static constexpr std::size_t kMostKnownForms = 256;
  /// After this many tasks without an answer to the same request, the device counts as not
  /// supporting the request, so no reply to it is expected.
  static constexpr int kUnknown = 3;
  /// How long after the latest request a reply of a device that is never polled (its Queries() is
  /// empty) may still come; at least twice LineTimes::ceiling.
  static constexpr Duration kOwedFor = 10s;

  /// True if the device answers probes, but none of them is a proof. After a disturbance it cannot
  /// be found out to which requests its replies belong.
  bool IsUnprovable(const Member& member) const {
    return entries_[member].proofless >= kProbesWithoutProof;
  }
  /// True if a wrong reply to `asked` would be noticed: `asked` is a proof, or only replies to
  /// proofs may still come.
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

// `LatestReadings` contains the points that were read and stored since the line was last silent for
// its longest reply time. If a reply comes twice, one of these readings belongs to another request,
// and it is unknown which.
class LatestReadings {
 public:
  struct Points {
    std::size_t device = 0;  ///< index of the device in the roster
    std::vector<std::size_t> points{};
    bool operator==(const Points&) const = default;
  };

  void OnStored(Points read) {
    if (std::ranges::find(read_, read) == read_.end()) read_.push_back(std::move(read));
  }
  /// Call when the line was silent for so long that no reply to an earlier request can come.
  void OnRested() { read_.clear(); }
  std::vector<Points> TakeAll() { return std::exchange(read_, {}); }

 private:
  std::vector<Points> read_;
};

// `OwedReplies` joins all parts that handle replies that may still come: how long they may come
// (LateReplies), to which request a reply belongs (WhoseReply), and which readings become uncertain
// if a reply came twice (LatestReadings).
struct OwedReplies {
  /// `roster` must stay valid for the lifetime of this object.
  explicit OwedReplies(const Roster& roster)
      : late_replies(roster), orders(roster), whose(roster, orders) {}

  /// Returns the exchange for a request that the line gets now. Its times are longer if late
  /// replies may come. `trusted`: the device has the option `trust_order`. `idle_since`: the line
  /// has been idle since then.
  Exchange ExchangeOf(const Asked& asked, bool trusted, Instant idle_since, Instant now);

  /// Call at the end of an exchange. `broadcast`: the request expected no reply.
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
