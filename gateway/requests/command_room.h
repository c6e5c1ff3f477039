// Room for the commands that wait for a line. Nobody has more of it than is left to others, so that
// a client that writes without end shuts nobody out:
//
//   room for 32: one client has 16 at most, a second 8 beside it, a third 4 …
//
// From any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "gateway/base/guarded.h"

namespace baudgate {

class CommandRoom {
 public:
  explicit CommandRoom(std::size_t limit) : limit_(limit) {}

  /// False: there is none for another command of this client.
  bool Take(const std::string& client) {
    const MutexLock lock(mutex_);
    const auto held = held_.find(client);
    const std::size_t own = held == held_.end() ? 0 : held->second;
    if (own + taken_ >= limit_) return false;
    ++held_[client];
    ++taken_;
    return true;
  }
  /// One that was taken has been answered.
  void Give(const std::string& client) {
    const MutexLock lock(mutex_);
    const auto held = held_.find(client);
    if (--held->second == 0) held_.erase(held);
    --taken_;
  }

 private:
  const std::size_t limit_;
  Mutex mutex_;
  std::size_t taken_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::map<std::string, std::size_t> held_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate
