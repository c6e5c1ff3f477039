// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/taking_thread.h"

#include <algorithm>

namespace baudgate::dds {

Duration RestAfter(Duration round) { return std::clamp<Duration>(9 * round, 0ns, 50ms); }

TakingThread::TakingThread(std::function<Duration()> round) : round_(std::move(round)) {
  thread_ = std::thread([this] {
    while (WaitForWork()) Rest(RestAfter(round_()));
  });
}

void TakingThread::Stop() {
  {
    const MutexLock lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void TakingThread::Wake() {
  {
    const MutexLock lock(mutex_);
    if (work_) return;
    work_ = true;
  }
  changed_.notify_one();
}

bool TakingThread::WaitForWork() {
  MutexLock lock(mutex_);
  while (!work_ && !stop_) lock.Wait(changed_);
  work_ = false;
  return !stop_;
}

void TakingThread::Rest(Duration time) {
  const Instant end = std::chrono::steady_clock::now() + time;
  MutexLock lock(mutex_);
  while (!stop_ && lock.WaitUntil(changed_, end)) {
  }
}

}  // namespace baudgate::dds
