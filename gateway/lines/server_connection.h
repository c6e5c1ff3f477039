// ConnectionProof tells when a connection has proven that it works. A local port does so by
// opening; a server may take the connection although it is in use by another client, and say so or
// close it.
//
//   bytes within 500 ms of the opening      heard: it may be the greeting of a server in use
//   these, and it still holds at 500 ms     proven
//   bytes later than that                   proven at once
//   a device has answered                   proven at once
//   nothing came, and it has held for 30 s  proven: it works, although no device answers
//   it ended before                         useless: the next one is news only once it is proven
//
// RestingConnection handles servers that end their connections by themselves.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"

namespace baudgate::lines {

class ConnectionProof {
 public:
  /// A connection behind which every device has been silent so long is made anew: a serial server
  /// may keep its TCP alive although its serial side hangs.
  static constexpr Duration kSilenceLimit = 30s;

  /// `network`: else a local port.
  explicit ConnectionProof(bool network) : network_(network) {}

  /// True: it is shown at once.
  bool OnOpened(Instant now) {
    told_ = state_ != State::useless;
    state_ = network_ ? State::fresh : State::proven;
    GoOn(now);
    return told_;
  }
  /// The same connection, which was lent.
  void GoOn(Instant now) {
    opened_ = now;
    if (network_) check_at_ = now + kGreeting;
  }
  /// True: it is proven now.
  bool NoteBytes(Instant now) {
    if (state_ == State::fresh) state_ = State::heard;
    if (state_ != State::heard || now - opened_ < kGreeting) return false;
    state_ = State::proven;
    return true;
  }
  /// The same, at check_at(). `silent`: no device has answered for kSilenceLimit.
  bool OnCheck(Instant now, bool silent) {
    check_at_.reset();
    if (!silent) check_at_ = now + kSilenceLimit / 4;
    const bool held = state_ == State::heard || now - opened_ >= kSilenceLimit;
    return held && Prove();
  }
  /// A device has answered over it. True: it is proven now.
  bool Prove() { return std::exchange(state_, State::proven) != State::proven; }
  /// It was ended. False: before it had worked.
  bool OnLost() {
    check_at_.reset();
    if (state_ == State::proven) return true;
    state_ = State::useless;
    return false;
  }
  /// The port was closed here.
  void OnClosed() {
    check_at_.reset();
    state_ = State::fresh;
  }
  /// Nothing is looked at until GoOn.
  void Pause() { check_at_.reset(); }

  /// The connection is proven, and that is shown now. True once for each connection.
  bool TakeNews() { return !std::exchange(told_, true); }
  const std::optional<Instant>& check_at() const { return check_at_; }

 private:
  static constexpr Duration kGreeting = 500ms;
  /// The state of the present connection, or of the last one if none is open.
  enum class State : std::uint8_t { fresh, heard, proven, useless };

  const bool network_;
  State state_ = State::fresh;
  bool told_ = false;
  Instant opened_{};
  std::optional<Instant> check_at_;
};

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
class RestingConnection {
 public:
  /// `wanted`: all the time, because a device speaks unasked. `transaction`: see TransactionBytes.
  explicit RestingConnection(bool wanted, std::size_t transaction = 0)
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
  void NoteBytes(Instant now) {
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

}  // namespace baudgate::lines
