// `ConnectionProof` decides when the connection of a line has proven that it works. A local port
// works once it is open. A server, however, can accept a connection while another client uses its
// port, and then send a message or close the connection.
//
//   bytes within 500 ms of the opening        heard: may be the message of a server in use
//   such bytes, and still open after 500 ms   proven
//   bytes later than 500 ms                   proven at once
//   a device has answered                     proven at once
//   no bytes, and still open after 30 s       proven: it works, although no device answers
//   ended before it was proven                useless: the next is reported as open when proven
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
  /// A connection is closed and opened again if no device behind it has answered for this time: a
  /// serial server can keep TCP alive although its serial side hangs.
  static constexpr Duration kSilenceLimit = 30s;

  /// `network`: the connection is TCP; else it is a local port.
  explicit ConnectionProof(bool network) : network_(network) {}

  /// Notes that the connection was opened. Returns true if this must be reported at once, false if
  /// only after the proof (TakeNews).
  bool OnOpened(Instant now) {
    told_ = state_ != State::useless;
    state_ = network_ ? State::fresh : State::proven;
    GoOn(now);
    return told_;
  }
  /// Restarts the times: at the opening, and when a loan over the same connection has ended.
  void GoOn(Instant now) {
    opened_ = now;
    if (network_) check_at_ = now + kGreeting;
  }
  /// Notes that bytes have come. Returns true if they prove the connection now.
  bool NoteBytes(Instant now) {
    if (state_ == State::fresh) state_ = State::heard;
    if (state_ != State::heard || now - opened_ < kGreeting) return false;
    state_ = State::proven;
    return true;
  }
  /// Must be called at check_at(). `silent`: no device has answered for kSilenceLimit. Returns true
  /// if the connection is proven now.
  bool OnCheck(Instant now, bool silent) {
    check_at_.reset();
    if (!silent) check_at_ = now + kSilenceLimit / 4;
    const bool held = state_ == State::heard || now - opened_ >= kSilenceLimit;
    return held && Prove();
  }
  /// Notes that a device has answered. Returns true if this proves the connection now.
  bool Prove() { return std::exchange(state_, State::proven) != State::proven; }
  /// Notes that the connection has ended. Returns false if it had not been proven.
  bool OnLost() {
    check_at_.reset();
    if (state_ == State::proven) return true;
    state_ = State::useless;
    return false;
  }
  void OnClosed() {
    check_at_.reset();
    state_ = State::fresh;
  }
  void Pause() { check_at_.reset(); }

  /// Returns true once if the opening was not reported at once (OnOpened) and must be reported now.
  bool TakeNews() { return !std::exchange(told_, true); }
  const std::optional<Instant>& check_at() const { return check_at_; }

 private:
  static constexpr Duration kGreeting = 500ms;
  /// The state of the current connection, or of the last connection if none is open.
  enum class State : std::uint8_t { fresh, heard, proven, useless };

  const bool network_;
  State state_ = State::fresh;
  bool told_ = false;
  Instant opened_{};
  std::optional<Instant> check_at_;
};

// RestingConnection handles connections that the server ends regularly, for example after each
// answer or after an idle time. The end of such a connection is not an outage: the next request
// opens it again.
//
// clang-format off
//   answered, ended while no request is open      rests: the next request opens it again
//   answered once, or soon after its opening,     rests, and each of the next 32 requests gets a
//   ended with a request open                     separate connection, because the server would
//                                                 end the next request, too. Then one connection
//                                                 is tried again. If the server repeats this, it
//                                                 is 128 requests, then 512, then 1,024
//   answered several times, ended with a          rests: a drop, or an end after an idle time
//   request open
//   ended before any answer with a request        rests, at most four times in a row: some servers
//   open, on a line with several devices          close when they do not know a device, and the
//                                                 other devices are asked next
//   ended before any answer, at the request       rests, at most four times in a row: the server
//   that ended the previous connection            closes at this request only
//   ended before any answer otherwise             an outage
//   ended although it is wanted all the time      an outage
// clang-format on
//
class RestingConnection {
 public:
  /// `wanted`: the connection is wanted all the time, because a device sends without a request.
  /// `transaction`: the number of bytes at the front of a request that differ each time.
  explicit RestingConnection(bool wanted, std::size_t transaction = 0)
      : wanted_(wanted), transaction_(transaction) {}

  /// Notes that a connection was opened; `answers` counts the answers on the line so far. Returns
  /// true if the previous connection rested: for the line, the new connection continues it.
  bool OnOpened(std::uint64_t answers, Instant now) {
    opened_ = now;
    if (answers > answers_before_) in_vain_ = 0;
    answers_before_ = answers;
    is_used_ = asks_ = false;
    survived_ = {};
    unanswered_ = 0;
    return std::exchange(rests_, false);
  }
  /// Notes that the server has ended the connection; `several`: more than one device is polled over
  /// it. Returns false if the end is an outage.
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
  /// Returns true if the server has ended a connection in use. Returns false for regular ends: soon
  /// after the opening, right after the first answer, after an idle time that is longer than any
  /// before, or at the request that ended the previous connection.
  bool IsDrop(std::uint64_t answers, Instant now) const {
    if (IsSoon(now)) return false;
    const Duration since = now - used_;
    const std::uint64_t its = answers - answers_before_;
    if (asks_) return its > 1 && !IsSameEnd();
    return (its > 1 || since >= kBehindAnswer) && its > 0 && since < survived_;
  }
  bool HasWorked(std::uint64_t answers) const { return answers > answers_before_; }
  void NoteBytes(Instant now) {
    OnUsed(now);
    // The previous connection ended at this request, which is answered now: the end had another
    // cause.
    if (asks_ && IsSameEnd()) ended_by_.clear();
    asks_ = false;
    unanswered_ = 0;
  }
  /// Must be called before a request is sent. Returns true if the request is held: it must not be
  /// sent until a new connection is open.
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
  /// Returns the request that was held; empty if it was given up.
  Bytes TakeHeld() {
    is_used_ = asks_ = !held_.empty();
    if (asks_) is_unsent_ = false;
    return std::exchange(held_, {});
  }
  void GiveUpHeld() { held_.clear(); }
  void End() {
    rests_ = false;
    held_.clear();
  }

  bool rests() const { return rests_; }
  /// True if the latest request was not sent: it waits, or was given up.
  bool is_unsent() const { return is_unsent_; }
  /// True if a request was sent over this connection, and no byte has come since.
  bool asks() const { return asks_; }
  int unanswered() const { return unanswered_; }
  bool in_vain() const { return in_vain_ > 0; }

 private:
  /// True if the server ended the previous connection at the same request, apart from the
  /// transaction number.
  bool IsSameEnd() const {
    return request_.size() > transaction_ &&
           std::ranges::equal(View(request_).subspan(transaction_),
                              View(ended_by_).subspan(std::min(transaction_, ended_by_.size())));
  }
  /// True within 150 ms of the opening. A server that ends each connection after its first answer
  /// may have answered more than once by then.
  bool IsSoon(Instant now) const { return now - opened_ < kSoon; }
  void OnUsed(Instant now) {
    if (is_used_) survived_ = std::max(survived_, now - used_);
    used_ = now;
  }

  static constexpr int kMostInVain = 4;
  // The fewest requests with a separate connection each. One lost request in 32 does no harm.
  static constexpr int kFewestAlone = 32;
  static constexpr int kMostAlone = 1024;
  static constexpr Duration kBehindAnswer = 100ms;
  static constexpr Duration kSoon = 150ms;

  const bool wanted_;
  const std::size_t transaction_;
  std::uint64_t answers_before_ = 0;
  Instant opened_{};
  Instant used_{};       // time of the last byte in or out
  Duration survived_{};  // the longest idle time that this connection has survived
  Bytes request_;
  // The latest request at which the server ended the connection, if it was not answered since.
  Bytes ended_by_;
  bool rests_ = false;
  int alone_ = 0;  // how many further requests get a separate connection
  int next_alone_ = kFewestAlone;
  bool is_used_ = false;  // a request was sent over this connection
  bool asks_ = false;
  int unanswered_ = 0;  // requests over this connection since the last byte
  int in_vain_ = 0;     // connections in a row that ended before any answer
  Bytes held_;
  bool is_unsent_ = false;
};

}  // namespace baudgate::lines
