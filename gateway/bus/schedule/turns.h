// Whether a line may take a turn at all: since when it is idle (IdleTime), what holds it (Hold),
// and how many turns it may take at one moment (TurnLimit). schedule.h says whose turn it is.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::bus {

// The time of the input that a line is handling, and since when the line has been idle. A part of
// gateway/bus/poller/poller.h.

/// A moment, and since when the line has been idle. `since == now`: an exchange has just ended.
struct Idle {
  Instant now{};
  Instant since{};
};

class IdleTime {
 public:
  /// An input comes; `idle`: the line is, before it. Returns the time since the last input.
  Duration OnInput(Now now, bool idle) {
    was_idle_ = idle;
    return now.instant - std::exchange(now_, now).instant;
  }
  /// The input was handled; `idle`: the line is idle after it.
  void OnHandled(bool idle) {
    if (idle && !was_idle_) since_ = now_.instant;
  }
  /// The port has opened, or the line goes on.
  void Restart() { since_ = now_.instant; }

  const Now& now() const { return now_; }
  Idle idle() const { return {now_.instant, since_}; }

 private:
  Now now_{};
  bool was_idle_ = false;
  Instant since_{};
};

// Whether a line may begin anything new. A part of gateway/bus/poller/poller.h.
//
//   held by       until
//   WindUp        the port opens again, or CallOffWindUp: it is given up as soon as the write under
//                 way has ended
//   Pause         GoOn, or the port closes: the line is wanted for something else meanwhile
//
class Hold {
 public:
  void OnOpened() { winding_up_ = paused_ = false; }
  void OnClosed() { paused_ = false; }
  void WindUp() { winding_up_ = true; }
  void CallOffWindUp() { winding_up_ = false; }
  void Pause(Instant now) {
    if (!std::exchange(paused_, true)) since_ = now;
  }
  /// False: there was no pause.
  bool GoOn() { return std::exchange(paused_, false); }

  /// Until when late replies are waited for in a pause, at most; empty: there is no pause.
  std::optional<Instant> WaitsUntil() const {
    return paused_ ? std::optional(since_ + kMostWait) : std::nullopt;
  }
  bool holds() const { return winding_up_ || paused_; }

 private:
  /// A telegram by hand does not wait longer for late replies.
  static constexpr Duration kMostWait = 4s;

  bool winding_up_ = false;
  bool paused_ = false;
  Instant since_{};
};

// Turns of a line that take no time. A handful at one moment is usual. Without an end they would
// hang the thread of the line, so after very many the line rests. A part of
// gateway/bus/poller/poller.h.
class TurnLimit {
 public:
  /// At one moment. All polls of a line that cannot be asked are far fewer.
  static constexpr int kMost = 20'000;
  static constexpr Duration kRest = 1s;
  static constexpr Duration kTellAgain = 1h;
  static constexpr const char* kWarning =
      "its line took 20000 turns in no time and now rests for 1 s after each 20000: report this "
      "error "
      "of the gateway or of a protocol's plugin";

  /// rest_and_tell: kWarning is due.
  enum class Turn : std::uint8_t { take, rest, rest_and_tell };
  Turn Take(Instant now) {
    if (now < rests_until_) return Turn::rest;
    if (now != moment_) taken_ = 0;
    moment_ = now;
    if (++taken_ <= kMost) return Turn::take;
    rests_until_ = now + kRest;
    if (now < told_until_) return Turn::rest;
    told_until_ = now + kTellAgain;
    return Turn::rest_and_tell;
  }
  /// Empty: it does not rest.
  std::optional<Instant> RestsUntil(Instant now) const {
    return now < rests_until_ ? std::optional(rests_until_) : std::nullopt;
  }

 private:
  Instant moment_{};
  int taken_ = 0;
  Instant rests_until_{};
  Instant told_until_{};
};

}  // namespace baudgate::bus
