// Remembers how the replies of each device look in general: whether they come twice, behind the
// next request, again and again, or without a character. A part of
// gateway/diagnosis/damage/examiner.h. Bounded memory.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "gateway/base/finding.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/by_member.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/diagnosis/damage/heard_exchange.h"
#include "gateway/diagnosis/damage/reply_lag.h"
#include "gateway/diagnosis/damage/same_again.h"
#include "gateway/diagnosis/damage/taken_replies.h"

namespace baudgate {

/// A request that was sent earlier gets no reply any more.
inline constexpr Duration kLongestLag = std::chrono::seconds(5);

class ReplyHabits {
 public:
  /// A request that has a reply has begun.
  void OnBegin(const Member& member) { ++of_[member].since; }
  /// Not a byte came to its last request, which is sent again; `tried`: its first try.
  void OnLost(const Member& member, Instant tried);
  void OnAnswered(const HeardExchange& exchange);

  /// A request that was lost and repeated lately.
  struct LostTry {
    Duration after{};      ///< from its first try until now
    std::size_t back = 0;  ///< exchanges of its member that have begun since
  };
  /// A second reply of the member came at `came`. One of both replies answers that request, and was
  /// late. Empty: there is no such request, so the device sends two replies. Each is taken once.
  std::optional<LostTry> TakeLostTry(const Member& member, Instant came);

  /// See ReplyLag.
  bool OnLate(const Member& member, Duration after, std::optional<Duration> next) {
    return of_[member].lag.OnLate(after, next);
  }
  /// True: the same came to other requests before. `right`: it is the reply. The transaction
  /// number is not compared.
  bool NoteSame(const HeardExchange& exchange, bool right);
  /// Beside its own reply there are only such as were taken for other requests just before:
  /// something in between sends twice.
  bool IsCopy(const HeardExchange& exchange) const;
  /// A text that seems to lack a character. If the same comes to the same request again, the device
  /// sends another form.
  Finding Compare(const HeardExchange& exchange, Finding finding);

 private:
  struct State {
    bool doubles = false;   // more than one reply came, and none was lost before
    Instant lost{};         // the first try of the last request that was repeated as nothing came
    std::size_t since = 0;  // exchanges that began since its last try without an answer
    ReplyLag lag;
    SameAgain same;
    TakenReply misfit;  // a text that lacks a character, and none was good to that request since
  };

  ByMember<State> of_;
  TakenReplies taken_;
};

}  // namespace baudgate
