// Whether a line may begin anything new. A part of gateway/bus/jobs/turn_taker.h.
//
//   held by       until
//   WindUp        the port opens again, or CallOffWindUp: it is given up as soon as the write under
//                 way has ended
//   Pause         GoOn, or the port closes: the line is wanted for something else meanwhile
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate {

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

}  // namespace baudgate
