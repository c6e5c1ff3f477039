// The loop of those modes of `watch` that print a line for whatever comes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <ostream>

#include "gateway/base/time.h"
#include "gateway/tools/terminal/stop_signals.h"
#include "gateway/tools/watch/listening.h"

namespace baudgate {

struct LineLoop {
  const StopSignals& signals;
  std::optional<Duration> seconds;  ///< the end, beside a signal and a reader of `out` that leaves
  int mailbox = -1;                 ///< readable when there is something to print
  std::function<void()> print;
};

void RunLineLoop(const LineLoop& loop, Listening& listening, std::ostream& out, std::ostream& err);

}  // namespace baudgate
