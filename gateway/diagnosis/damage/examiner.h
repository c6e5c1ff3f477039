// Keeps what comes from a line between one request and the next, and says what it looked like
// (gateway/diagnosis/damage/examine.h). For the status, and for one rule: a device whose late reply
// it finds is blamed for its silence for ten minutes (gateway/bus/devices/heard_points.h). Which
// replies count is decided in gateway/bus/replies/whose_reply.h. A part of
// gateway/diagnosis/observer.h. Bounded memory. Its parts have a question each:
//
//   heard_exchange.h     what came in this exchange?
//   server_greeting.h    what did the connection say before the first request?
//   earlier_replies.h    whose earlier reply was that?
//   reply_habits.h       what do the replies of this device look like in general?
//
//   Begin          a request goes out; More() has told what came after the one before
//   Hear(bytes)    at any time
//   End(outcome)   what the exchange looked like
//   More()         what it looks like now, where more has come after its end
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/diagnosis/damage/earlier_replies.h"
#include "gateway/diagnosis/damage/examine.h"
#include "gateway/diagnosis/damage/heard_exchange.h"
#include "gateway/diagnosis/damage/reply_habits.h"
#include "gateway/diagnosis/damage/server_greeting.h"

namespace baudgate {

class Examiner {
 public:
  /// It outlives this.
  explicit Examiner(const Roster& roster) : roster_(roster) {}
  Examiner(const Examiner&) = delete;
  Examiner& operator=(const Examiner&) = delete;

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

  /// See EarlierReplies.
  std::optional<EarlierFinding> TakeEarlier() { return earlier_.Take(); }

 private:
  void OnAnswered();
  Finding Look();
  Finding LookAgain(Finding finding);
  Finding Greet(Finding finding);

  const Roster& roster_;
  HeardExchange exchange_;  // the last one
  ServerGreeting greeting_;
  ReplyHabits habits_;
  EarlierReplies earlier_{habits_};
  Symptom told_ = Symptom::clean;
  bool negotiated_ = false;
};

}  // namespace baudgate
