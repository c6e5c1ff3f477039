// Connections of a server that ends them by itself, as some do after each answer and others after a
// rest. Such an end is no outage: the next request opens the connection again.
//
// clang-format off
//   answered, ended while nothing is asked        rests; opened by the next request
//   answered once, or soon behind its opening,    the same, and each of the next 32 requests gets
//   ended with a request under way                its own connection: the next would be lost, too.
//                                                 Then one connection is tried again. When the same
//                                                 happens again it is 128 requests, then 512, then
//                                                 1,024
//   answered again and again, ended likewise      rests: a drop, or an end behind a rest
//   ended before any answer, with a request       the same, four times at most: some servers close
//   under way, where the line has several         for a device that they do not know, and the
//   devices                                       others are asked next
//   ended before any answer, with the request     the same, four times at most: the server closes
//   that ended the connection before              at this request, and serves others
//   ended before any answer otherwise             an outage
//   ended although it is wanted all the time      an outage
// clang-format on
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"

namespace baudgate {

class Rest {
 public:
  /// `wanted`: all the time, because a device speaks unasked. `transaction`: see TransactionBytes.
  explicit Rest(bool wanted, std::size_t transaction = 0)
      : wanted_(wanted), transaction_(transaction) {}

  /// A connection was opened, after this many answers on the line. True: it continues one that
  /// rested.
  bool OnOpened(std::uint64_t answers, Instant now) {
    opened_ = now;
    if (answers > answers_before_) in_vain_ = 0;
    answers_before_ = answers;
    is_used_ = asks_ = false;
    survived_ = {};
    unanswered_ = 0;
    return std::exchange(rests_, false);
  }
  /// The server has ended it; `several`: more than one device is polled over it. False: that is an
  /// outage.
  bool OnEnded(std::uint64_t answers, bool several, Instant now) {
    if (rests_ || wanted_) return false;
    const std::uint64_t its = answers - answers_before_;
    const bool answered = its > 0;
    const bool in_vain = (several || IsSameEnd()) && asks_ && in_vain_ < kMostInVain;
    if (asks_) ended_by_ = request_;
    if (!answered && !in_vain) {
      in_vain_ = 0;
      return false;
    }
    in_vain_ = answered ? 0 : in_vain_ + 1;
    const bool behind_answer = its == 1 || (its > 1 && IsSoon(now));
    if (behind_answer && asks_) {
      alone_ = next_alone_;
      next_alone_ = std::min(4 * next_alone_, kMostAlone);
    } else if (its > 1 && !behind_answer) {
      next_alone_ = kFewestAlone;
    }
    return rests_ = true;
  }
  /// Whether the server has ended a connection that was in use: not behind each answer, not after a
  /// rest as long as any before, and not at the request that has ended the connection before.
  bool IsDrop(std::uint64_t answers, Instant now) const {
    if (IsSoon(now)) return false;
    const Duration since = now - used_;
    const std::uint64_t its = answers - answers_before_;
    if (asks_) return its > 1 && !IsSameEnd();
    return (its > 1 || since >= kBehindAnswer) && its > 0 && since < survived_;
  }
  /// The connection, after this many answers on the line.
  bool HasWorked(std::uint64_t answers) const { return answers > answers_before_; }
  void OnBytes(Instant now) {
    OnUsed(now);
    if (asks_ && IsSameEnd()) ended_by_.clear();  // it is answered: the end had another cause
    asks_ = false;
    unanswered_ = 0;
  }
  /// A request is to be sent. True: it waits for a connection to be opened.
  bool Holds(View request, Instant now) {
    OnUsed(now);
    request_.assign(request.begin(), request.end());
    const bool holds = rests_ || (alone_ > 0 && is_used_);
    if (alone_ > 0) --alone_;
    if (holds) {
      rests_ = true;
      held_.assign(request.begin(), request.end());
    }
    is_unsent_ = holds;
    is_used_ = asks_ = !holds;
    unanswered_ += holds ? 0 : 1;
    return holds;
  }
  /// The request that has waited, if it is still wanted.
  Bytes TakeHeld() {
    is_used_ = asks_ = !held_.empty();
    if (asks_) is_unsent_ = false;
    return std::exchange(held_, {});
  }
  void GiveUpHeld() { held_.clear(); }
  /// It is closed for another reason.
  void End() {
    rests_ = false;
    held_.clear();
  }

  bool rests() const { return rests_; }
  /// The latest request has not gone out: it is held, or was given up.
  bool is_unsent() const { return is_unsent_; }
  /// A request went out over this connection, and nothing has come since.
  bool asks() const { return asks_; }
  /// How many went out in a row without an answer.
  int unanswered() const { return unanswered_; }
  /// The last connection ended before any answer.
  bool in_vain() const { return in_vain_ > 0; }

 private:
  /// The request that ended the connection before has met an end again.
  bool IsSameEnd() const {
    return request_.size() > transaction_ &&
           std::ranges::equal(View(request_).subspan(transaction_),
                              View(ended_by_).subspan(std::min(transaction_, ended_by_.size())));
  }
  /// The server ends connections behind the first answer, and others have come meanwhile.
  bool IsSoon(Instant now) const { return now - opened_ < kSoon; }
  void OnUsed(Instant now) {
    if (is_used_) survived_ = std::max(survived_, now - used_);
    used_ = now;
  }

  static constexpr int kMostInVain = 4;
  static constexpr int kFewestAlone = 32;  // a lost request in so many is no trouble for the device
  static constexpr int kMostAlone = 1024;
  static constexpr Duration kBehindAnswer = 100ms;
  static constexpr Duration kSoon = 150ms;

  const bool wanted_;
  const std::size_t transaction_;
  std::uint64_t answers_before_ = 0;
  Instant opened_{};
  Instant used_{};       // the last byte in or out
  Duration survived_{};  // the longest rest after which this connection was still there
  Bytes request_;        // the latest
  Bytes ended_by_;       // the latest request that met the end, and was not answered since
  bool rests_ = false;
  int alone_ = 0;  // requests that still get a connection each
  int next_alone_ = kFewestAlone;
  bool is_used_ = false;  // a request went out over this connection
  bool asks_ = false;     // and nothing has come since
  int unanswered_ = 0;    // requests over this connection since then
  int in_vain_ = 0;       // connections in a row that ended before any answer
  Bytes held_;
  bool is_unsent_ = false;  // see above
};

}  // namespace baudgate
