// The time of the input that a line is handling, and since when the line has been idle. A part of
// gateway/bus/poller/poller.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "gateway/base/time.h"

namespace baudgate {

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

}  // namespace baudgate
