// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/taking_thread.h"

#include <algorithm>
#include <utility>

namespace baudgate::dds {

Duration RestAfter(Duration round) { return std::clamp<Duration>(9 * round, 0ns, 50ms); }

TakingThread::TakingThread(std::function<Duration()> round)
    : round_(std::move(round)),
      worker_("dds take", [this](bool last) { return last ? kWhenWoken : Take(); }) {
  worker_.Start();
}

/// A wake-up during its rest is served after the rest.
void TakingThread::Wake() {
  if (!work_.exchange(true)) worker_.Wake();
}

Instant TakingThread::Take() {
  if (!work_) return kWhenWoken;
  if (ReadClocks().instant < rests_until_) return rests_until_;
  work_ = false;
  const Duration busy = round_();
  rests_until_ = ReadClocks().instant + RestAfter(busy);
  return kWhenWoken;
}

}  // namespace baudgate::dds
