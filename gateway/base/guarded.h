// `Mutex` is a mutex that the members it guards must name: `Counters counters_
// BAUDGATE_GUARDED_BY(mutex_);`. A build with clang refuses code that reads or writes such a member
// without the lock; gcc ignores the marks.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <mutex>

#include "gateway/base/time.h"

#ifdef __clang__
#define BAUDGATE_THREAD_MARK(mark) __attribute__((mark))
#else
#define BAUDGATE_THREAD_MARK(mark)
#endif

/// Marks a member that must be used only while `mutex` is held.
#define BAUDGATE_GUARDED_BY(mutex) BAUDGATE_THREAD_MARK(guarded_by(mutex))
/// Marks a function whose caller must hold `mutex`.
#define BAUDGATE_REQUIRES(mutex) BAUDGATE_THREAD_MARK(requires_capability(mutex))

namespace baudgate {

class BAUDGATE_THREAD_MARK(capability("mutex")) Mutex {
 public:
  void Lock() BAUDGATE_THREAD_MARK(acquire_capability()) { mutex_.lock(); }
  void Unlock() BAUDGATE_THREAD_MARK(release_capability()) { mutex_.unlock(); }

 private:
  friend class MutexLock;
  std::mutex mutex_;
};

/// Holds the mutex for its lifetime. Write a wait as a loop, not with a lambda, so that clang sees
/// that the condition is checked under the lock: `while (queue_.empty()) lock.Wait(changed_);`
class BAUDGATE_THREAD_MARK(scoped_lockable) MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) BAUDGATE_THREAD_MARK(acquire_capability(mutex))
      : lock_(mutex.mutex_) {}
  ~MutexLock() BAUDGATE_THREAD_MARK(release_capability()) {}
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

  /// Releases the mutex and waits until `changed` is notified. Can also return without a
  /// notification (spuriously).
  void Wait(std::condition_variable& changed) { changed.wait(lock_); }
  /// Like Wait, but returns at `when` at the latest. Returns false if `when` has come.
  bool WaitUntil(std::condition_variable& changed, Instant when) {
    return changed.wait_until(lock_, when) == std::cv_status::no_timeout;
  }

 private:
  std::unique_lock<std::mutex> lock_;
};

}  // namespace baudgate
