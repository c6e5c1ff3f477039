// To which request does a reply belong? A reading is good only if no reply that may still be owed
// could pass for its own. This keeps what may be owed: by a device, and by a serial server that may
// shift the whole line. After silence, damage, a second reply or a closed port nothing is proven;
// then a probe goes first whose reply can be told from all others (a proof: `is_proof` in
// protocols/conversation.h). The cases are a table in whose_reply.cpp.
// gateway/bus/jobs/job_sending.cpp reports every request, gateway/bus/poller/reply_judge.cpp every
// reply of the line; docs/timeouts.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/bus/devices/by_member.h"
#include "gateway/bus/devices/identity.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/replies/answer_order.h"
#include "gateway/bus/replies/asked.h"
#include "gateway/bus/replies/lost_replies.h"
#include "gateway/bus/replies/reply_orders.h"

namespace baudgate {

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
    return states_[member].answered_probe ? states_[member].proven_at + kProofHolds : Instant{};
  }
  Instant ProofRenews(const Member& member) const {
    return states_[member].proven_at + kProofRenews;
  }
  /// Whether a reply of an odd form is accepted, because no other reply is owed.
  bool MayBeOdd(const Asked& asked) const {
    return states_[*asked.member].read && orders_.Owed(asked) == 1;
  }
  /// When its order was last proven, replies were still owed.
  bool Lags(const Member& member) const { return states_[member].lag > 0; }
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
  bool HasName(const Member& member) const { return states_[member].identity.names(); }

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
  void OnEnd(const Asked& asked, Outcome outcome, bool silent, Instant now);
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
  struct State {
    Identity identity;
    bool answered_probe = false;
    bool strangers = false;  // their replies may be owed by it, since OnOpened
    bool read = false;       // a poll was answered in step, as it was asked, since OnReconnect
    int lag = 0;             // replies owed when its order was last proven
    Instant proven_at{};     // when a probe was answered last
    int proofless = 0;       // answered probes in a row that were no proofs
    Bytes proof_reply;       // the latest to a proof
    std::vector<Bytes> odd;  // requests whose latest replies had a form that was not asked for
    std::set<Bytes> shown;   // requests that it has answered in their form, since OnOpened
    bool proves = false;     // a proof is one of these
    // By request that was not answered since OnReconnect: how many of its tasks met silence.
    std::map<Bytes, int> silences;
  };
  /// Fewer probes find a device that does not answer its identification
  /// (protocols/common/probe_choice.h).
  static constexpr int kProbesWithoutProof = 8;
  /// How long a proof holds. Only a probe reveals a device that is one reply ahead because one
  /// reply came twice, or a device that was swapped unnoticed.
  static constexpr Duration kProofHolds = 1min;
  static constexpr Duration kProofRenews = 45s;
  /// For each device.
  static constexpr std::size_t kMostOdd = 16;
  static constexpr std::size_t kMostShown = 256;
  /// A device that did not answer this many tasks with the same request is taken not to know it, so
  /// it owes no reply.
  static constexpr int kUnknown = 3;
  /// How long a device without reads owes a reply that nothing can prove to be lost; at least twice
  /// its ceiling.
  static constexpr Duration kOwedFor = 10s;

  /// It answers probes, and none of them is a proof: after a disturbance nothing shows whose its
  /// replies are.
  bool IsUnprovable(const Member& member) const {
    return states_[member].proofless >= kProbesWithoutProof;
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
  void NoteShown(const Asked& asked, Outcome outcome);

  const Roster& roster_;
  ReplyOrders& orders_;
  ByMember<State> states_;
  LostReplies lost_;
};

}  // namespace baudgate
