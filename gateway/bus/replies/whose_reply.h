// To which request does a reply belong? A reading is good only if no reply that may still be owed
// could pass for its own. This keeps what may be owed: by a device, and by a serial server that may
// shift the whole line. After silence, damage, a second reply or a closed port nothing is proven;
// then a probe goes first whose reply can be told from all others (a proof: `is_proof` in
// protocols/conversation.h). The cases are a table in whose_reply.cpp.
// gateway/bus/jobs/job.cpp reports every request and every reply of the line; docs/timeouts.md.
// AnswerOrder, ReplyOrders and LostReplies keep the requests, Identity keeps the name of a device,
// and LatestReadings what was read last; OwedReplies joins all with LateReplies.
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

// Which of the latest requests was answered last, as far as that can be known. Replies of these
// protocols carry no number, but they come in the order of their requests, each once:
//
//   ?A1   no reply        it is lost, or still owed
//   ?A2   a reply         to ?A2, or to ?A1 while that to ?A2 is still owed
//   ?A2   a reply         whichever was answered before, this one is to a ?A2
//
// There is one for each device, which may lag by itself, and one for the line, because a serial
// server in front of it delays all replies. Used by WhoseReply.
struct SentRequest {
  std::size_t place = kNobody;  ///< in the roster: the member it went to
  Bytes bytes;                  ///< see Asked::question
  Instant at{};
  bool proof = false;  ///< its reply differs from those to all polls of the device
  Bytes context{};     ///< see Request

  static constexpr std::size_t kNobody = ~std::size_t{0};  ///< none was sent
  static constexpr std::size_t kStranger = kNobody - 1;    ///< another master's, of unknown content
};

class AnswerOrder {
 public:
  /// The most requests whose replies may be owed; older ones are given up.
  static constexpr std::size_t kMostOwed = 63;
  /// The most replies that another master is owed.
  static constexpr std::size_t kMostOfStrangers = 3;

  void OnSent(const SentRequest& request);
  /// Up to three replies to requests of another master may still come, and any reply may be one of
  /// them. Three in all, however often a port is opened before anything is answered.
  void OnStranger(Instant now);
  /// No other master has asked.
  void ForgetStrangers();
  /// Whether a reply may answer this request, which was sent so many `before` the latest.
  using MayAnswer = std::function<bool(const SentRequest&, std::size_t before)>;
  /// A reply came. `fits`: it may answer the latest request. False: it answers none of those that
  /// are owed a reply, and nothing has changed.
  bool OnAnswer(bool fits, const MayAnswer& may_answer);
  /// Since a proof was answered, nothing but the latest request was sent, perhaps several times. So
  /// nothing is owed, and of all earlier replies only that to the proof may come again.
  bool IsBehindProof() const;
  /// Behind a proof, a reply fits neither: the device answers the latest request in another form,
  /// or somebody else has answered.
  void OnOddForm() { answered_ |= 1; }
  /// A reply came that answers nothing that is owed: the order is lost. Any earlier request may
  /// have been answered last, and only a reply that can belong to few of them shows which one.
  void OnLost();
  /// Whether an earlier request may have this reply, even if nothing seems to be owed.
  bool MayBeEarlier(const MayAnswer& may_answer) const;
  /// A reply has come twice, so one more than before may be owed.
  void OnCopy();
  /// Nothing is owed.
  void Reset() { answered_ = 1; }
  /// If the latest request was sent before this time, no reply is expected any more.
  void ForgetBefore(Instant time) {
    if (SentBefore(0).at < time) Reset();
  }

  /// How many of the latest requests may still be answered.
  std::size_t Owed() const { return static_cast<std::size_t>(std::bit_width(answered_)) - 1; }
  /// Whether one of these is among them.
  bool Owes(const std::function<bool(const SentRequest&)>& is_one) const;
  /// True if `is_one` holds for one of the latest requests, answered or not.
  bool Remembers(const MayAnswer& is_one) const;
  /// Nothing is owed: the latest request was answered last.
  bool IsInStep() const { return answered_ == 1; }
  bool MayBeInStep() const { return (answered_ & 1U) != 0; }
  /// Whether an owed reply would be recognised, whatever is sent next: all that are owed answer
  /// proofs.
  bool IsSafe() const;
  /// Whether the latest reply is certain to answer `request`, the bytes of the latest request:
  /// every request that the reply may answer has these bytes and the same context.
  bool IsAnswerTo(const Bytes& request) const;
  /// Whether the latest reply can only belong to the latest request and to those of the same bytes
  /// directly before it.
  bool IsOfLatest() const;
  /// How much earlier than the latest request the oldest one was sent to which the reply may
  /// belong.
  Duration Older() const { return SentBefore(0).at - SentBefore(Owed()).at; }

 private:
  std::uint64_t Fitting(std::size_t nearest, std::size_t end, const MayAnswer& may_answer) const;
  const SentRequest& SentBefore(std::size_t requests) const {
    return sent_[(count_ - requests) % sent_.size()];
  }
  /// It asks the same as the latest one.
  bool IsSame(std::size_t lag) const {
    const SentRequest& latest = SentBefore(0);
    return SentBefore(lag).bytes == latest.bytes && SentBefore(lag).context == latest.context;
  }

  std::array<SentRequest, kMostOwed + 1> sent_{};
  std::size_t count_ = kMostOwed;  // of requests; the latest is sent_[count_ % size]
  std::uint64_t answered_ = 1;  // bit n: the request n before the latest may be the last answered
};

// The orders of replies on a line: one for each device, and one for all requests together, because
// a serial server in front of the line delays all replies alike. A reply that carries its sender's
// address is none of those that the server owes to others, so for such a request the order of its
// device counts alone.
class ReplyOrders {
 public:
  explicit ReplyOrders(const Roster& roster) : roster_(roster) {}

  /// Learns the address that its replies carry, from its first request. Entries of one address are
  /// one device on the wire, and share one order.
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
  /// `fits`: see AnswerOrder.
  void OnAnswer(const Member& member, bool fits, const AnswerOrder::MayAnswer& may_answer) {
    const bool own = Of(member).OnAnswer(fits, may_answer);
    const bool known = line_.OnAnswer(fits, may_answer);
    if (!known) line_.OnLost();
    if (!own && !known) Of(member).OnLost();
  }
  /// A reply came that does not answer `asked`. True if the reply answers a request to another
  /// device, and replies name their device: the count for `asked.member` then stays as it is.
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
  /// See AnswerOrder.
  bool IsBehindProof(const Asked& asked) const {
    return Of(*asked.member).IsBehindProof() && (asked.names_itself() || line_.IsBehindProof());
  }
  void OnOddForm(const Member& member) {
    Of(member).OnOddForm();
    line_.OnOddForm();
  }
  /// A reply has come twice.
  void OnCopy(const Member& member) {
    Of(member).OnCopy();
    line_.OnCopy();
  }
  /// See AnswerOrder.
  void ForgetBefore(const Member& member, Instant time) {
    Of(member).ForgetBefore(time);
    line_.ForgetBefore(time);
  }
  /// Nothing is owed by this device, and nothing by the server.
  void Reset(const Member& member) {
    Of(member).Reset();
    line_.Reset();
  }

  /// The latest reply may belong to this, the latest request.
  bool MayBeInStep(const Asked& asked) const {
    return Of(*asked.member).MayBeInStep() && (asked.names_itself() || line_.MayBeInStep());
  }
  /// The latest reply belongs to this request or its repetitions, and to no earlier task's.
  bool IsOfLatest(const Asked& asked) const {
    return Of(*asked.member).IsOfLatest() && (asked.names_itself() || line_.IsOfLatest());
  }
  /// The latest reply answers this request, or an earlier one of the same bytes.
  bool IsAnswerTo(const Asked& asked) const {
    const Bytes question = asked.question();
    return Of(*asked.member).IsAnswerTo(question) &&
           (asked.names_itself() || line_.IsAnswerTo(question));
  }
  /// An owed reply would be recognised, whatever is sent next.
  bool IsSafe(const Asked& asked) const {
    return Of(*asked.member).IsSafe() && (asked.names_itself() || line_.IsSafe());
  }
  /// How many replies may still come: before OnSent to earlier requests only, after it also its
  /// own.
  int Owed(const Asked& asked) const {
    const std::size_t own = Of(*asked.member).Owed();
    return static_cast<int>(asked.names_itself() ? own : std::max(own, line_.Owed()));
  }
  /// Another device of the line may owe a reply that comes before the awaited one. The two counts
  /// of owed replies do not tell: a reply that comes while another device is asked is not taken off
  /// those that its own device owes.
  bool OthersOwe(const Asked& asked) const {
    return line_.Owes([&](const SentRequest& sent) {
      const auto& everyone = roster_.everyone();
      return sent.place < everyone.size() && !everyone[sent.place]->IsSame(*asked.member);
    });
  }
  /// See AnswerOrder.
  Duration Older(const Asked& asked) const {
    const Duration own = Of(*asked.member).Older();
    return asked.names_itself() ? own : std::max(own, line_.Older());
  }

 private:
  static constexpr std::size_t kSelf = static_cast<std::size_t>(-1);
  struct Entry {
    AnswerOrder order;
    std::size_t first = kSelf;  // place of the first entry of the same address, whose order counts
  };

  /// The place of the entry whose order counts for it.
  std::size_t FirstOf(const Member& member) const {
    const std::size_t first = devices_[member].first;
    return first == kSelf ? member.place : first;
  }

  const Roster& roster_;
  ByMember<Entry> devices_;
  AnswerOrder line_;  // of all requests, whoever they went to
};

// Replies that never came from slaves that only routes reach. The order of their requests is not
// kept, so a reply that was only late may come in place of the reply to the next request. Used by
// WhoseReply; docs/timeouts.md, "Requests of transparent routes".
class LostReplies {
 public:
  /// Which earlier, lost requests a reply could answer instead of the present one.
  struct Older {
    bool other = false;  ///< a request of other bytes
    bool same = false;   ///< an earlier one of the same bytes
  };

  /// There was no reply to `request`, or a damaged one.
  void OnLost(const Member& slave, const Bytes& request, Instant now);
  /// Whether a reply to a request that began at this time may be one of the lost ones.
  bool MayCome(const Member& slave, Instant began) const;
  /// Which lost requests this reply could answer; `fits`: whether it could answer one.
  using MayFit = std::function<bool(const Bytes& request)>;
  Older MayBe(const Member& slave, const Bytes& request, Instant began, const MayFit& fits) const;
  /// A reply came, the `count`-th in a row to the same request. False: it may belong to an earlier
  /// one. Example: two were lost, so the third reply to one request must be its own.
  bool OnReply(const Member& slave, const Bytes& request, Older older, std::size_t count);

 private:
  struct Entry {
    std::optional<Instant> lost_at;  // the latest
    std::vector<Bytes> requests;     // the latest
  };
  /// Assumed: no slave takes longer for a reply. One whose ceiling is longer is guarded for these 5
  /// s only. Needed by PollerRoutedFaults.ALateReplyOfAnotherLengthIsNotAcceptedAsAnOddReply.
  static constexpr Duration kLatest = 5s;
  static constexpr std::size_t kMost = 8;

  ByMember<Entry> entries_;
};

// What a device answers to the request that identifies it. Used by WhoseReply.
class Identity {
 public:
  bool known() const { return !reply_.empty(); }
  /// The device reports its name, and does not only refuse to.
  bool names() const { return known() && names_; }
  /// Whether this is the request that identifies the device.
  bool IsAskedBy(const Bytes& request) const { return known() && request == request_; }
  /// Whether these bytes are what it answers to that.
  bool Is(View reply) const;

  /// The request was answered like this, and the reply can be to no other request.
  void Learn(const Bytes& request, View reply, Outcome outcome);
  /// The request was answered by a reply that Is knows.
  void OnSame() {
    other_.clear();
    certain_ = true;
  }
  /// It has come more than once.
  bool certain() const { return certain_; }
  /// The request was answered otherwise. True: as the last time. Once may be damage, where replies
  /// carry no check value.
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
  /// `orders`: the replies that devices and the line still owe. Both outlive it.
  WhoseReply(const Roster& roster, ReplyOrders& orders) : roster_(roster), orders_(orders) {}

  /// See ReplyOrders.
  void Recognise(Member& member, const Bytes& sender) { orders_.Recognise(member, sender); }
  bool MayBeInStep(const Asked& asked) const { return orders_.MayBeInStep(asked); }
  bool IsOfLatest(const Asked& asked) const { return orders_.IsOfLatest(asked); }
  /// How many replies may come before the one to this request, which got another's. `of_sender`:
  /// that was one of its own device.
  int RepliesBefore(const Asked& asked, bool of_sender) const {
    const bool nearer = of_sender || !asked.names_itself() || orders_.OthersOwe(asked);
    return nearer ? orders_.Owed(asked) : 0;
  }
  /// Waiting brings no reply of it: it owes none, or lags by as many replies as ever.
  bool IsSettled(const Member& member) const {
    return Lags(member) || orders_.Of(member).IsInStep();
  }
  /// Before the first request of a task of a device: whether a reply to an earlier request could
  /// pass for its own, or it is not known which device answers.
  bool NeedsProbeFirst(const Asked& asked, Instant now) const;
  /// True if the device has no points to read and has never answered a probe. Example: a relay card
  /// that does not know function 08. Its writes are sent without a probe, and a write that is
  /// answered shows that the card is there.
  bool IsProbedByWrites(const Device& device) const;
  /// Until when its latest proof holds, and from when on it may be renewed.
  Instant ProofEnds(const Member& member) const {
    return entries_[member].answered_probe ? entries_[member].proven_at + kProofHolds : Instant{};
  }
  Instant ProofRenews(const Member& member) const {
    return entries_[member].proven_at + kProofRenews;
  }
  /// Whether a reply of an odd form is accepted, because no other reply is owed.
  bool MayBeOdd(const Asked& asked) const {
    return entries_[*asked.member].read && orders_.Owed(asked) == 1;
  }
  /// When its order was last proven, replies were still owed.
  bool Lags(const Member& member) const { return entries_[member].lag > 0; }
  /// Nothing but its own reply to a client's request can come. Of slaves that only routes reach no
  /// order is kept: they owe nothing when all that they were lately asked was answered.
  bool IsOwedAlone(const Asked& asked) const;
  /// The lost requests to a slave that only routes reach that a reply could answer: see
  /// LostReplies.
  LostReplies::Older MayBeLost(const Asked& asked, const LostReplies::MayFit& fits) const {
    return lost_.MayBe(*asked.member, asked.request->bytes, asked.sent, fits);
  }
  /// A reply of such a slave has come. False: it may belong to an earlier request.
  bool OnRoutedReply(const Asked& asked, LostReplies::Older older, std::size_t count) {
    return lost_.OnReply(*asked.member, asked.request->bytes, older, count);
  }
  /// It reports its name: another device in its place would be noticed.
  bool HasName(const Member& member) const { return entries_[member].identity.names(); }

  void OnSent(const Asked& asked, Instant now);

  struct Verdict {
    bool elsewhere = false;  ///< it belongs to another request
    bool proven = true;      ///< it belongs to this one, or to an earlier one of the same bytes
    Duration older{};        ///< how much earlier, at most, the request was sent that it may answer
    bool replaced = false;   ///< another device answers in its place
    bool shifted = false;    ///< nothing was owed and it does not fit: an earlier one came twice
    bool odd = false;        ///< it does not fit, and is no copy of an earlier one
  };
  /// A reply of the device itself came, good or not what was asked for.
  Verdict OnReply(const Asked& asked, View reply, Outcome outcome);
  /// The exchange is over. `silent`: an answer was due and the port stayed open.
  void NoteOutcome(const Asked& asked, Outcome outcome, bool silent, Instant now);
  /// Another master may have asked it: this program before its last start, or a program to which
  /// the port was lent. A server that lags may still deliver the replies to that.
  void OnOpened(const Member& member, Instant now);
  /// Another device may be connected now.
  void OnReconnect(const Member& member);

  /// A proof was wanted, and the device cannot be probed. A read needs none: it is asked again
  /// until its reply must be its own. A write cannot be asked again. So if the device has no reads,
  /// replies that it may owe to another master are taken for lost, and replies to requests of this
  /// gateway some time after the latest one (kOwedFor). Until then a reply that may answer an
  /// earlier request confirms nothing.
  void OnNoProof(const Device& device, Instant now);

  /// After its reply came a second, different one: one of the two belongs to another request.
  void OnSecondReply(const Member& member);

 private:
  struct Entry {
    Identity identity;
    bool answered_probe = false;
    bool strangers = false;       // their replies may be owed by it, since OnOpened
    bool read = false;            // a poll was answered in step, as it was asked, since OnReconnect
    int lag = 0;                  // replies owed when its order was last proven
    Instant proven_at{};          // when a probe was answered last
    int proofless = 0;            // answered probes in a row that were no proofs
    Bytes proof_reply;            // the latest to a proof
    std::vector<Bytes> odd;       // requests whose latest replies had a form that was not asked for
    std::set<Bytes> known_forms;  // requests that it has answered in their form, since OnOpened
    bool proves = false;          // a proof is one of these
    // By request that was not answered since OnReconnect: how many of its tasks met silence.
    std::map<Bytes, int> silences;
  };
  /// Fewer probes find a device that does not answer its identification
  /// (protocols/common/identification.h).
  static constexpr int kProbesWithoutProof = 8;
  /// How long a proof holds. Only a probe reveals a device that is one reply ahead because one
  /// reply came twice, or a device that was swapped unnoticed.
  static constexpr Duration kProofHolds = 1min;
  static constexpr Duration kProofRenews = 45s;
  /// For each device.
  static constexpr std::size_t kMostOdd = 16;
  static constexpr std::size_t kMostKnownForms = 256;
  /// A device that did not answer this many tasks with the same request is taken not to know it, so
  /// it owes no reply.
  static constexpr int kUnknown = 3;
  /// How long a device without reads owes a reply that nothing can prove to be lost; at least twice
  /// its ceiling.
  static constexpr Duration kOwedFor = 10s;

  /// It answers probes, and none of them is a proof: after a disturbance nothing shows whose its
  /// replies are.
  bool IsUnprovable(const Member& member) const {
    return entries_[member].proofless >= kProbesWithoutProof;
  }
  /// A reply in place of its own would be noticed.
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

// The points that were read and stored since the line last rested for its longest reply time. If a
// reply comes twice, one of these readings may belong to another request; which is not known.
class LatestReadings {
 public:
  /// Points of one query of a device.
  struct Points {
    std::size_t device = 0;  ///< its place
    std::vector<std::size_t> points{};
    bool operator==(const Points&) const = default;
  };

  void OnStored(Points read) {
    if (std::ranges::find(read_, read) == read_.end()) read_.push_back(std::move(read));
  }
  /// The line has rested: no reply to an earlier request is owed any more.
  void OnRested() { read_.clear(); }
  std::vector<Points> TakeAll() { return std::exchange(read_, {}); }

 private:
  std::vector<Points> read_;
};

// Replies that may still come: until when (late_replies.h), to which request, and which readings
// are in doubt if one came twice.
struct OwedReplies {
  /// `roster` outlives it.
  explicit OwedReplies(const Roster& roster)
      : late_replies(roster), orders(roster), whose(roster, orders) {}

  /// The exchange of a request that the line is given now: as long as what is owed demands.
  /// `trusted`: the device has `trust_order`; `idle_since`: since when the line is idle.
  Exchange ExchangeOf(const Asked& asked, bool trusted, Instant idle_since, Instant now);

  /// The exchange of a request has ended; `broadcast`: no answer was due.
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
