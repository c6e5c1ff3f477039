// `Worker` runs rounds of work on a thread that has a name. It is for threads that are not event
// loops:
//
//   Worker worker_{"state", [this](bool last) { return Write(last); }};
//   ... worker_.Start();  // at the end of the constructor
//   ... worker_.Wake();   // from any thread: there is work
//
// The first round runs at the start. A further round runs when the worker was woken, or at the time
// that the last round returned. A round that finds no work returns at once. Stop runs one last
// round, in which the worker completes its work.
//
// Several workers may share one `WorkThread`. They take turns: no worker runs two rounds while
// another waits. For example, the audit waits for at most one round of the events, however many
// events are queued.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/guarded.h"
#include "gateway/base/result.h"

namespace baudgate {

/// The time of the next round for a worker that only waits for Wake.
inline constexpr Instant kWhenWoken = Instant::max();

/// A thread for several workers. It takes no signals.
class WorkThread {
 public:
  /// `name` is shown by `top -H`; the kernel stores 15 bytes. The thread starts with its first
  /// worker.
  explicit WorkThread(std::string name);
  /// All workers of the thread must have stopped.
  ~WorkThread();
  WorkThread(const WorkThread&) = delete;
  WorkThread& operator=(const WorkThread&) = delete;

 private:
  friend class Worker;
  struct State;
  // Shared with the thread, which may live longer than this object.
  const std::shared_ptr<State> state_;
};

class Worker {
 public:
  /// One round of work. Returns the time of the next round; a time in the past means at once.
  /// `last`: no round follows.
  using Round = std::function<Instant(bool last)>;

  /// Runs on a separate thread. Declare the worker as the last member of its owner, so that it
  /// stops before the other members are destroyed.
  Worker(std::string name, Round round);
  /// Runs on `thread`, together with other workers. `thread` must outlive the worker.
  Worker(WorkThread& thread, Round round);
  ~Worker() { Stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Starts the rounds; call it once. Throws std::system_error if the system has no thread left.
  void Start();
  /// Requests a round without waiting for it. Thread-safe.
  void Wake();
  /// Requests the last round without waiting for it. Idempotent. Thread-safe.
  void RequestStop();
  /// Requests the last round and waits until it has ended; a worker that was never started has no
  /// last round. Must not be called from a round. Idempotent.
  void Stop();
  /// Like RequestStop, but the thread can outlive this object, so the round must own all that it
  /// uses. Allowed only for a worker with a separate thread.
  void Leave();
  bool stopping() const;

 private:
  struct Job;

  std::unique_ptr<WorkThread> own_;
  std::shared_ptr<WorkThread::State> state_;
  std::shared_ptr<Job> job_;
  bool left_ = false;

  friend struct WorkThread::State;
};

/// Runs `work`, which can hang, on a thread that can outlive main(). Does not wait for it. Fails if
/// the system has no thread left.
Status StartDetached(const std::string& name, std::function<void()> work);

/// Items that wait for a worker, first in, first out. If the queue is full, a new item is dropped
/// and counted. Thread-safe.
template <typename Item>
class WorkQueue {
 public:
  explicit WorkQueue(std::size_t most) : most_(most) {}

  bool Put(Item&& item) {
    const MutexLock lock(mutex_);
    if (items_.size() >= most_) {
      ++dropped_;
      return false;
    }
    items_.push_back(std::move(item));
    return true;
  }
  std::optional<Item> Take() {
    const MutexLock lock(mutex_);
    if (items_.empty()) return std::nullopt;
    std::optional<Item> item(std::move(items_.front()));
    items_.pop_front();
    return item;
  }
  bool full() const {
    const MutexLock lock(mutex_);
    return items_.size() >= most_;
  }
  std::uint64_t dropped() const {
    const MutexLock lock(mutex_);
    return dropped_;
  }

 private:
  const std::size_t most_;
  mutable Mutex mutex_;
  std::deque<Item> items_ BAUDGATE_GUARDED_BY(mutex_);
  std::uint64_t dropped_ BAUDGATE_GUARDED_BY(mutex_) = 0;
};

}  // namespace baudgate
