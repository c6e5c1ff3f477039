// Keeps what comes from a line between one request and the next, and says what it looked like
// (gateway/diagnosis/damage/examine.h). For the status, and for one rule: a device whose late reply
// it finds is blamed for its silence for ten minutes (gateway/bus/devices/device_health.h). Which
// replies count is decided in gateway/bus/replies/whose_reply.h. A part of
// gateway/diagnosis/observer.h. Bounded memory. Its parts have a question each:
//
//   HeardExchange (reply_habits.h)        what came in this exchange?
//   ServerGreeting                        what did the connection say before the first request?
//   EarlierReplies (earlier_replies.h)    whose earlier reply was that?
//   ReplyHabits (reply_habits.h)          what do the replies of this device look like in general?
//
//   Begin          a request goes out; More() has told what came after the one before
//   Hear(bytes)    at any time
//   End(outcome)   what the exchange looked like
//   More()         what it looks like now, where more has come after its end
//
// Overheard examines bytes of a device that sends unasked.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/finding.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/diagnosis/damage/earlier_replies.h"
#include "gateway/diagnosis/damage/reply_habits.h"

namespace baudgate {

// Keeps what a connection says before anything is asked: another service, a word of a server that
// is in use, or Telnet. The greeting explains why no device answers, until one does.
//
//   opened, "Login: ", a request, silence     the greeting explains it
//   opened, a request, "Login: "              the same: a server's words may meet the first request
//   opened, "Login: ", a request, its reply   forgotten: it has kept nobody from answering
//
class ServerGreeting {
 public:
  void OnOpened() {
    first_ = true;
    text_.clear();
  }
  /// Bytes have come before the first request.
  void OnBytes(View bytes) {
    Append(text_, bytes.first(std::min(bytes.size(), kMost - text_.size())));
  }
  /// A device has answered. Returns what the connection had said until then; `heard`: with the
  /// reply.
  Bytes OnAnswered(View heard) {
    Bytes said = std::exchange(text_, {});
    if (said.empty() && first_) said.assign(heard.begin(), heard.end());
    return said;
  }
  /// An exchange has ended, whether answered or not. `speaks`: what was heard in it are words, or
  /// another service.
  void OnEnd(View heard, bool speaks) {
    const bool first = std::exchange(first_, false);
    if (first && speaks && text_.empty()) text_.assign(heard.begin(), heard.end());
  }

  /// Empty: it has said nothing, or a device has answered since.
  const Bytes& text() const { return text_; }

 private:
  static constexpr std::size_t kMost = 1024;

  Bytes text_;
  bool first_ = true;  // no exchange has ended since the port was opened
};

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

// Bytes of a device that sends unasked which its conversation could not read: what they looked like
// (gateway/diagnosis/damage/examine.h). Bounded memory.
//
//   Hear(bytes)    at any time; returns what the bytes before looked like, if these begin new ones
//   OnDamaged()    what they look like so far
//
class Overheard {
 public:
  /// Both outlive it.
  Overheard(const Device& device, const Roster& roster);

  /// Empty: what came before was read, or looks as reported already.
  std::optional<Finding> Hear(View bytes, Instant now);
  Finding OnDamaged();
  /// The next message could be read, so it is not the rest of the damaged one.
  void OnRead() { damaged_ = false; }

 private:
  Finding Look() const;
  bool IsRest() const;

  const Device& device_;
  const Roster& roster_;
  const Expectation expect_;
  Bytes heard_;  // since the last silence
  Bytes torn_;   // before the last silence, if they were damaged
  Instant last_{};
  Duration pause_{};   // between these two
  Duration before_{};  // the silence before both
  bool damaged_ = false;
};

}  // namespace baudgate
