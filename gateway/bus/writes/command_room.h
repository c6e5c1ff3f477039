// Room for the commands that wait for a line. No client has more of it than is left to others, so a
// client that writes without end locks nobody out. Nor does one that connects, writes and leaves
// again and again: commands of clients that have left are never sent, and take no room.
//
//   room for 32: one client has 16 at most, a second 8 beside it, a third 4 …
//
// From any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/guarded.h"

namespace baudgate {

class CommandRoom {
 public:
  /// True once the client of a command has left; null: it never does.
  using Abandoned = std::shared_ptr<const std::atomic<bool>>;
  using Ticket = std::uint64_t;

  /// Abandoned commands that the line has not discarded yet.
  static constexpr std::size_t kMostAbandoned = 1024;

  explicit CommandRoom(std::size_t limit) : limit_(limit) {}

  /// Empty: there is no room for another command of this client.
  std::optional<Ticket> Take(const std::string& client, Abandoned abandoned = nullptr) {
    const MutexLock lock(mutex_);
    const auto waits = [](const auto& held) { return !held.second.IsAbandoned(); };
    const auto taken = static_cast<std::size_t>(std::ranges::count_if(held_, waits));
    const auto own = static_cast<std::size_t>(std::ranges::count_if(
        held_, [&](const auto& held) { return waits(held) && held.second.client == client; }));
    if (own + taken >= limit_ || held_.size() - taken >= kMostAbandoned) return std::nullopt;
    held_.emplace(++last_, Held{client, std::move(abandoned)});
    return last_;
  }
  /// The command has been answered.
  void Give(Ticket ticket) {
    const MutexLock lock(mutex_);
    held_.erase(ticket);
  }

 private:
  struct Held {
    bool IsAbandoned() const { return abandoned && *abandoned; }

    std::string client;
    Abandoned abandoned;
  };

  const std::size_t limit_;
  Mutex mutex_;
  Ticket last_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::map<Ticket, Held> held_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate
