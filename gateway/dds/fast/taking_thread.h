// The thread on which a subscriber takes its samples. Fast DDS 2.9 walks through all instances with
// every take: whoever takes at each sample falls behind, so it rests after each take.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <thread>

#include "gateway/base/guarded.h"
#include "gateway/base/time.h"

namespace baudgate::dds {

/// Nine times as long as the last round took, and 50 ms at most: a few points are taken at once,
/// thousands in lots.
Duration RestAfter(Duration round);

class TakingThread {
 public:
  /// `round` takes what is there; it returns how long the library was busy with it.
  explicit TakingThread(std::function<Duration()> round);
  ~TakingThread() { Stop(); }
  TakingThread(const TakingThread&) = delete;
  TakingThread& operator=(const TakingThread&) = delete;

  void Stop();  ///< `round` does not run after it
  /// There is something to take. From any thread, never waits for a round.
  void Wake();

 private:
  bool WaitForWork();
  void Rest(Duration time);

  const std::function<Duration()> round_;
  Mutex mutex_;
  std::condition_variable changed_;
  bool work_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool stop_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace baudgate::dds
