// Outputs that are woken when a feed has more for them. From any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include "gateway/base/guarded.h"

namespace baudgate::events {

class FeedListeners {
 public:
  using Listener = std::uint64_t;
  /// `wake` is called on the thread that fills the feed; it returns at once.
  Listener Listen(std::function<void()> wake) {
    const MutexLock lock(mutex_);
    listeners_.emplace(next_, std::move(wake));
    return next_++;
  }
  /// When this returns, it is not called any more.
  void Leave(Listener listener) {
    const MutexLock lock(mutex_);
    listeners_.erase(listener);
  }
  void Wake() const {
    const MutexLock lock(mutex_);
    for (const auto& [listener, wake] : listeners_) wake();
  }

 private:
  mutable Mutex mutex_;
  std::map<Listener, std::function<void()>> listeners_ BAUDGATE_GUARDED_BY(mutex_);
  Listener next_ BAUDGATE_GUARDED_BY(mutex_) = 1;
};

}  // namespace baudgate::events
