// Writes log lines to a descriptor that may block: a pipe that is not read, a stopped terminal. A
// thread of its own writes; the caller only queues a line, and never waits.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "gateway/base/worker.h"

namespace baudgate::log {

/// Thread-safe. Lines that find no room are dropped and counted; the reader is told how many as
/// soon as it reads again.
class Outlet {
 public:
  static constexpr std::size_t kMostBytes = 256 * 1024;

  explicit Outlet(int descriptor, std::size_t most_bytes = kMostBytes);
  /// Does not wait for a thread that is held by its reader.
  ~Outlet();
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;

  /// `line` ends with a line feed.
  void Put(std::string line);
  /// Waits until all is written. False: `patience` is over.
  bool Flush(Duration patience);
  std::uint64_t dropped() const;

 private:
  struct Queue;
  static void WriteQueued(Queue& queue);

  const std::shared_ptr<Queue> queue_;  // shared with the thread, which may outlive the outlet
  Worker worker_;
  bool has_thread_ = true;  // false: none is left, and the caller writes
};

}  // namespace baudgate::log
