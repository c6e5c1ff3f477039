// The way from a line's thread to the Modbus server's: how a write or a routed request ended. It
// may outlive the server, because lines answer when they can; what comes after Close is dropped.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <functional>
#include <utility>

#include "gateway/base/guarded.h"
#include "gateway/base/time.h"

namespace baudgate::modbus {

class Inbox {
 public:
  using Clocks = std::function<Now()>;

  /// `clocks` tells each task when it runs.
  void Open(asio::io_context& io, Clocks clocks) {
    const MutexLock lock(mutex_);
    io_ = &io;
    clocks_ = std::move(clocks);
  }
  void Close() {
    const MutexLock lock(mutex_);
    io_ = nullptr;
  }
  /// From any thread. `task` takes a `const Now&`.
  template <typename Task>
  void Post(Task task) {
    const MutexLock lock(mutex_);
    if (io_ == nullptr) return;
    asio::post(*io_, [task = std::move(task), clocks = clocks_]() mutable { task(clocks()); });
  }

 private:
  Mutex mutex_;
  asio::io_context* io_ BAUDGATE_GUARDED_BY(mutex_) = nullptr;
  Clocks clocks_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::modbus
