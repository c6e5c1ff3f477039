// Finds in an exchange what belongs to an earlier one: a reply that is late or comes again, the
// rest of one that broke off, a request that comes back late. gateway/bus/replies/whose_reply.h
// decides which replies count. A part of gateway/diagnosis/damage/examiner.h. Bounded memory.
//
//   > ?A1
//   > ?B1      < !A1=5 !B1=7          !A1=5 is the late reply to ?A1
//
//   > ?A1      < !A1=5
//   > ?A2      < !A1=5 !A2=6          !A1=5 has come again
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/by_member.h"
#include "gateway/bus/devices/line_observer.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/diagnosis/damage/broken_reply.h"
#include "gateway/diagnosis/damage/heard_exchange.h"
#include "gateway/diagnosis/damage/numbered_requests.h"
#include "gateway/diagnosis/damage/reply_habits.h"

namespace baudgate {

class EarlierReplies {
 public:
  /// It outlives this.
  explicit EarlierReplies(ReplyHabits& habits) : habits_(habits) {}

  /// The exchange has begun. `unanswered`: what came to the one before, if that was with the same
  /// member.
  void OnBegin(const HeardExchange& exchange, Bytes unanswered);
  void OnAnswered(const HeardExchange& exchange);
  void OnEnd(const HeardExchange& exchange);
  /// The rest of its reply may come later.
  void OnBroken(const HeardExchange& exchange);
  /// That rest has come in the same exchange.
  void OnMended() { broken_ = {}; }

  /// The rest of a reply that broke off has come in this exchange.
  bool FindRest(const HeardExchange& exchange);
  /// The bytes beside the reply of this exchange answer a request that was lost and repeated.
  bool FindBeside(const HeardExchange& exchange, const Finding& finding);
  /// A second reply of the member has come: what is found where one of both was late.
  std::optional<Finding> FindLostTry(const Member& member, Instant came);
  /// The finding of this exchange, where what came may be the reply to another request.
  Finding Attribute(const HeardExchange& exchange, Finding finding);
  /// A request of this gateway has come back so late that it looks like another master's.
  bool IsLateEcho(const HeardExchange& exchange) const;

  /// A reply of another member that was late or came twice, or the rest of an earlier reply, found
  /// in the exchange that was looked at last. Empty: there are no more.
  std::optional<EarlierFinding> Take();

 private:
  struct Open {
    const Member* member = nullptr;
    Request request;
    Instant sent{};
    Instant first{};  // the first try of those that have no answer, within the ceiling
    Instant tried{};  // the first try of the last seconds
    Bytes vain;       // what came to the try before it
    bool answered = false;
    bool silent = false;    // and not a byte came
    bool late = false;      // its reply has come late
    bool repeated = false;  // what was found is the same reply once more
    Bytes reply;
    std::optional<Finding> in_its_place{};  // what came late says why there is no reply
  };
  /// The last exchange of a member, and the one before it.
  struct LastTwo {
    Open last;
    Open before;
  };
  /// When a reply to an earlier request came.
  struct Came {
    Duration after{};     // behind the first try of that request
    Duration lateness{};  // since it was due
    bool late = false;
    bool early = false;              // the last bytes came soon behind the request of the exchange
    std::optional<Duration> next{};  // so soon behind the next request; empty: not soon
  };

  Open* FindEarlier(const HeardExchange& exchange);
  static bool TakeIfAnswered(Open& open, const HeardExchange& exchange);
  static Came CameOf(const HeardExchange& exchange, const Open& whose);
  Finding Late(const Open& open, const Came& came);
  std::optional<Finding> LateByNumber(const HeardExchange& exchange);
  bool FindNumberedBeside(const HeardExchange& exchange);
  Finding AttributeToItself(const HeardExchange& exchange, const Open& whose, const Came& came,
                            Finding finding);
  Finding AttributeToAnother(const HeardExchange& exchange, Open& whose, const Came& came,
                             Finding finding);

  ReplyHabits& habits_;
  ByMember<LastTwo> open_;
  NumberedRequests numbered_;
  BrokenReply broken_;
  Bytes beside_;  // what stands behind the reply of the last exchange, where its number told of it
  std::vector<EarlierFinding> found_;
};

}  // namespace baudgate
