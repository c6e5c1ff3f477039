// The thread on which a subscriber takes its samples. Fast DDS 2.9 walks through all instances with
// every take: a thread that takes at each sample would fall behind, so it rests after each take.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>

#include "gateway/base/worker.h"

namespace baudgate::dds {

/// Nine times as long as the last round took, and 50 ms at most: a few points are taken at once,
/// thousands in lots.
Duration RestAfter(Duration round);

class TakingThread {
 public:
  /// `round` takes what is there; it returns how long the library was busy with it.
  explicit TakingThread(std::function<Duration()> round);

  void Stop() { worker_.Stop(); }  ///< `round` does not run after it
  /// There is something to take. From any thread, never waits for a round.
  void Wake();

 private:
  Instant Take();

  const std::function<Duration()> round_;
  std::atomic<bool> work_ = false;
  Instant rests_until_{};
  Worker worker_;
};

}  // namespace baudgate::dds
