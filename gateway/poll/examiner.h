// Keeps what comes from a line between one request and the next, and says what it looked like
// (gateway/line/examine.h). For the status, and for one rule: a device whose late reply it finds is
// blamed for its silence for ten minutes (heard_points.h). Which replies count is decided in
// whose_reply.h. Driven by gateway/poll/reception.h. Bounded memory.
//
//   Begin          a request goes out; More() has told what came after the one before
//   Hear(bytes)    at any time
//   End(outcome)   what the exchange looked like
//   More()         what it looks like now, where more has come after its end
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/line/examine.h"
#include "gateway/poll/broken_reply.h"
#include "gateway/poll/by_member.h"
#include "gateway/poll/heard_exchange.h"
#include "gateway/poll/numbered_requests.h"
#include "gateway/poll/reply_lag.h"
#include "gateway/poll/roster.h"
#include "gateway/poll/same_again.h"
#include "gateway/poll/server_greeting.h"
#include "gateway/poll/taken_replies.h"

namespace baudgate {

class Examiner {
 public:
  explicit Examiner(const Roster& roster) : roster_(roster) {}

  /// The port has opened.
  void OnOpened() {
    exchange_.OnOpened();
    greeting_.OnOpened();
  }
  void Begin(const Member& member, const Request& request, const LineTimes& times, Instant now);
  void Hear(View bytes, Instant now);
  /// The frame was taken for the reply.
  void Take(View frame) { exchange_.Take(frame); }
  Finding End(Outcome outcome);
  /// Empty: it looks as before. Each change is returned once.
  std::optional<Finding> More();
  /// The connection began as Telnet, and yet a device has answered. True once.
  bool TakeNegotiation() { return std::exchange(negotiated_, false); }
  /// The member whose exchange began last; null: there was none.
  const Member* member() const { return exchange_.member(); }

  /// What an earlier exchange looks like now: the one of `member` that is `back` before its last.
  struct Earlier {
    const Member* member = nullptr;
    Finding finding{};
    std::size_t back = 0;
    Duration lateness{};  ///< since it was due; zero: it was not late
  };
  /// A reply of another member that was late or came twice, or the rest of an earlier reply, found
  /// in the exchange that was looked at last. Empty: there are no more.
  std::optional<Earlier> TakeEarlier();

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
  /// The last exchange of a member, and the one before it; and what is known of its replies.
  struct LastTwo {
    Open last;
    Open before;
    bool doubles = false;   // more than one reply came, and none was lost before
    Instant lost{};         // the first try of the last request that was repeated as nothing came
    std::size_t since = 0;  // exchanges that began since its last try without an answer
    ReplyLag lag;
    SameAgain same;
    TakenReply misfit;  // a text that lacks a character, and none was good to that request since
  };

  bool IsCopy() const;
  bool IsSameAgain(bool right);
  std::optional<Duration> RestCame() const;
  bool FindRest();
  Finding Look();
  void OnFound(Symptom symptom);
  Finding Compare(Finding finding);
  bool IsOfLostTry(const Member& member);
  std::optional<Finding> LateByNumber();
  Finding Attribute(Finding finding);
  Finding Late(const Open& open, Duration after, std::optional<Duration> next);
  Open* FindEarlier();
  bool IsLateEcho() const;
  static bool Fits(const Open& open, View frame);
  static std::optional<Finding> InItsPlace(const Open& open, View frame);
  bool Answers(Open& open) const;

  const Roster& roster_;
  HeardExchange exchange_;  // the last one
  Symptom told_ = Symptom::clean;
  ByMember<LastTwo> open_;
  TakenReplies taken_;
  ServerGreeting greeting_;
  bool negotiated_ = false;
  std::vector<Earlier> earlier_;
  BrokenReply broken_;
  NumberedRequests numbered_;
};

}  // namespace baudgate
