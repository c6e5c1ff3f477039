// Looks now and then whether this machine's clock is known to be synchronised (NTP, PTP, GPS), and
// tells when that has changed: only then may devices be told the time. On a thread of its own,
// because who is asked may take seconds.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <thread>

#include "gateway/base/guarded.h"

namespace baudgate {

class HostClock {
 public:
  /// `tell` hears on the own thread of the first time that it is right, and of every change.
  explicit HostClock(std::function<void(bool right)> tell);
  /// Ends as soon as no answer is under way.
  void RequestStop();
  /// The same, and waits for it.
  ~HostClock();
  HostClock(const HostClock&) = delete;
  HostClock& operator=(const HostClock&) = delete;

 private:
  void Run();
  /// False: it ends.
  bool Sleep(Duration time);

  const std::function<void(bool)> tell_;
  Mutex mutex_;
  std::condition_variable ends_;
  bool stop_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace baudgate
