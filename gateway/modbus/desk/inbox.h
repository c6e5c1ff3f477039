// The way from a line's thread to the Modbus server's: how a write or a routed request ended. It
// may outlive the server, because lines answer when they can; what comes after Close is dropped.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <utility>

#include "gateway/base/guarded.h"

namespace baudgate::modbus {

class Inbox {
 public:
  void Open(asio::io_context& io) {
    const MutexLock lock(mutex_);
    io_ = &io;
  }
  void Close() {
    const MutexLock lock(mutex_);
    io_ = nullptr;
  }
  /// From any thread.
  template <typename Task>
  void Post(Task task) {
    const MutexLock lock(mutex_);
    if (io_ != nullptr) asio::post(*io_, std::move(task));
  }

 private:
  Mutex mutex_;
  asio::io_context* io_ BAUDGATE_GUARDED_BY(mutex_) = nullptr;
};

}  // namespace baudgate::modbus
