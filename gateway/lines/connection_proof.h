// When a connection has proven that it works. A local port does so by opening; a server may take
// the connection although it is in use by another client, and say so or close it.
//
//   bytes within 500 ms of the opening      heard: it may be the greeting of a server in use
//   it has held for 500 ms behind that      proven
//   nothing came, and it has held for 30 s  proven: it works, although no device answers
//   it ended before                         useless: the next one is news only once it is proven
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate {

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
  bool OnBytes(Instant now) {
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

}  // namespace baudgate
