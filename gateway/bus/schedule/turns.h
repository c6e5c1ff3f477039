// Whether a line may take a turn at all: since when it is idle (`IdleTime`), what holds it
// (`Hold`), and how many turns it may take at one moment (`TurnLimit`). schedule.h decides whose
// turn it is.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::bus {

// `IdleTime` keeps the time of the input that a line is handling, and since when the line has been
// idle. Part of gateway/bus/poller/poller.h.

/// The present time, and since when the line has been idle. `since == now`: an exchange has just
/// ended.
struct Idle {
  Instant now{};
  Instant since{};
};

class IdleTime {
 public:
  /// Call before an input is handled. `idle`: the line is idle at this moment. Returns the time
  /// since the last input.
  Duration OnInput(Now now, bool idle) {
    was_idle_ = idle;
    return now.instant - std::exchange(now_, now).instant;
  }
  /// The input was handled; `idle`: the line is idle after it.
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

// `Hold` prevents a line from beginning a new job. Part of gateway/bus/poller/poller.h.
//
//   held by       why, and until when
//   WindUp        the port will be closed when the write under way has ended; until the port opens
//                 again, or CallOffWindUp
//   Pause         another use needs the line; until GoOn, or until the port closes
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
  /// Ends the pause. Returns false if there was none.
  bool GoOn() { return std::exchange(paused_, false); }

  /// Returns until when late replies are awaited in a pause, at most; empty: there is no pause.
  std::optional<Instant> WaitsUntil() const {
    return paused_ ? std::optional(since_ + kMostWait) : std::nullopt;
  }
  bool holds() const { return winding_up_ || paused_; }

 private:
  /// A telegram by hand waits for late replies no longer than this.
  static constexpr Duration kMostWait = 4s;

  bool winding_up_ = false;
  bool paused_ = false;
  Instant since_{};
};

// `TurnLimit` limits the turns of a line that take no time. A few turns at one moment are normal.
// Without a limit they could hang the thread of the line, so the line rests after very many. Part
// of gateway/bus/poller/poller.h.
class TurnLimit {
 public:
  /// The most turns at one moment. All polls of a line that cannot be asked are far fewer.
  static constexpr int kMost = 20'000;
  static constexpr Duration kRest = 1s;
  static constexpr Duration kTellAgain = 1h;
  static constexpr const char* kWarning =
      "its line took 20000 turns in no time and now rests for 1 s after each 20000: report this "
      "error "
      "of the gateway or of a protocol's plugin";

  /// Counts a turn. rest_and_tell: the line rests, and kWarning is due.
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
  /// Returns until when the line rests; empty: it does not rest.
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
