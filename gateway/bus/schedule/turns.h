// Three small parts of `Poller` that decide whether a line may start a job: `IdleTime` contains
// since when the line is idle, `Hold` prevents new jobs, and `TurnLimit` stops an endless loop.
// (gateway/bus/schedule/schedule.h decides which job is next.)
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::bus {

/// The present time, and since when the line has been idle. If both are equal, an exchange has just
/// ended.
struct Idle {
  Instant now{};
  Instant since{};
};

class IdleTime {
 public:
  /// Call before the line handles an input. `idle`: the line is idle at this moment. Returns the
  /// time since the previous input.
  Duration OnInput(Now now, bool idle) {
    was_idle_ = idle;
    return now.instant - std::exchange(now_, now).instant;
  }
  void OnHandled(bool idle) {
    if (idle && !was_idle_) since_ = now_.instant;
  }
  /// Call when the port has opened, or the line continues after a pause.
  void Restart() { since_ = now_.instant; }

  const Now& now() const { return now_; }
  Idle idle() const { return {now_.instant, since_}; }

 private:
  Now now_{};
  bool was_idle_ = false;
  Instant since_{};
};

// `Hold` keeps a line from starting a new job. Part of `Poller`.
//
//   called   when                                           the hold ends
//   WindUp   the port will be closed, after the write       when the port opens again, or with
//            under way has ended                            CallOffWindUp
//   Pause    a telegram that a user sends needs the line    with GoOn, or when the port closes
class Hold {
 public:
  void OnOpened() { winding_up_ = paused_ = false; }
  void OnClosed() { paused_ = false; }
  void WindUp() { winding_up_ = true; }
  void CallOffWindUp() { winding_up_ = false; }
  void Pause(Instant now) {
    if (!std::exchange(paused_, true)) since_ = now;
  }
  /// Ends the pause. Returns false if there was no pause.
  bool GoOn() { return std::exchange(paused_, false); }

  /// Returns until when the telegram waits for late replies of devices. Empty: there is no pause.
  std::optional<Instant> WaitsUntil() const {
    return paused_ ? std::optional(since_ + kMostWait) : std::nullopt;
  }
  bool holds() const { return winding_up_ || paused_; }

 private:
  /// Longest time that a telegram of a user (`baudgate ask`) waits for late replies of devices.
  static constexpr Duration kMostWait = 4s;

  bool winding_up_ = false;
  bool paused_ = false;
  Instant since_{};
};

// `TurnLimit` protects the thread of a line from an endless loop: it counts turns (steps of jobs)
// while the time stays the same, and makes the line rest for kRest after kMost of them. A few turns
// at the same time are normal. Part of `Poller`.
class TurnLimit {
 public:
  /// Greatest number of turns at the same time; far more than the polls of any line.
  static constexpr int kMost = 20'000;
  static constexpr Duration kRest = 1s;
  static constexpr Duration kTellAgain = 1h;
  static constexpr const char* kWarning =
      "its line has worked through 20000 steps without any pause, so the gateway now stops it for "
      "1 s after each 20000. Report this error of the gateway or of a protocol's plugin";

  /// Take counts a turn and returns whether the line may go on (`take`) or rests. `rest_and_tell`:
  /// the user is to be warned as well (kWarning), at most once in kTellAgain.
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
