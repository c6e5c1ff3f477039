// What comes on the DDS library's threads, for the one that prints. While that one is stuck (a
// pager) Put waits, and the library keeps only the latest of each instance: memory stays bounded.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <condition_variable>
#include <cstdint>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"

namespace baudgate {

template <typename Item>
class Mailbox {
 public:
  Mailbox() = default;
  ~Mailbox() {
    if (wake_ >= 0) ::close(wake_);
  }
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  void Put(Item item) {
    {
      MutexLock lock(mutex_);
      while (!closed_ && items_.size() >= kMost) lock.Wait(room_);
      if (closed_) return;
      items_.push_back(std::move(item));
      if (items_.size() > 1) return;  // the reader has been woken already
    }
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(wake_, &one, sizeof one);
  }
  std::vector<Item> TakeAll() {
    const MutexLock lock(mutex_);
    std::uint64_t count = 0;
    [[maybe_unused]] const auto got = ::read(wake_, &count, sizeof count);
    room_.notify_all();
    return std::exchange(items_, {});
  }
  /// Nothing waits in Put from now on, and what is put is dropped.
  void Close() {
    const MutexLock lock(mutex_);
    closed_ = true;
    room_.notify_all();
  }
  void Reopen() {
    const MutexLock lock(mutex_);
    closed_ = false;
  }
  /// Readable when something is in it.
  int descriptor() const { return wake_; }

 private:
  static constexpr std::size_t kMost = 10'000;

  const int wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  Mutex mutex_;
  std::condition_variable room_;
  std::vector<Item> items_ BAUDGATE_GUARDED_BY(mutex_);
  bool closed_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

}  // namespace baudgate
