// Threads that are not event loops. A worker runs rounds on a thread that has a name:
//
//   Worker worker_{"state", [this](bool last) { return Write(last); }};
//   ... worker_.Start();  // at the end of the constructor
//   ... worker_.Wake();   // from any thread: there is something to do
//
// The first round runs at the start. A further round runs when the worker has been woken, or when
// the time comes that the last round returned. A round that finds nothing to do returns at once.
// Stop runs one last round, in which the worker finishes what is left.
//
// Several workers may share one thread. They take turns: no worker runs two rounds while another
// waits. So the audit waits for one round of the events at most, however many events are queued.
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

/// The time of the next round for a worker that only waits to be woken.
inline constexpr Instant kWhenWoken = Instant::max();

/// A thread for several workers. It takes no signals.
class WorkThread {
 public:
  /// `name`: as `top -H` shows it; the kernel keeps 15 bytes. The thread starts with its first
  /// worker.
  explicit WorkThread(std::string name);
  /// Its workers have stopped.
  ~WorkThread();
  WorkThread(const WorkThread&) = delete;
  WorkThread& operator=(const WorkThread&) = delete;

 private:
  friend class Worker;
  struct State;
  const std::shared_ptr<State> state_;  // the thread has it as well, and may outlive this
};

class Worker {
 public:
  /// Returns when the next round is due. A time in the past: at once. `last`: no round follows.
  using Round = std::function<Instant(bool last)>;

  /// With a thread of its own. The last member of its owner, which it stops before the others go.
  Worker(std::string name, Round round);
  /// With others on `thread`, which outlives it.
  Worker(WorkThread& thread, Round round);
  ~Worker() { Stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Once. Throws std::system_error where the system has no thread left.
  void Start();
  /// From any thread; never waits for a round.
  void Wake();
  /// The last round runs next. From any thread; does not wait for it. Idempotent.
  void RequestStop();
  /// The same, and returns after the last round; one that was not started has none. Not from a
  /// round. Idempotent.
  void Stop();
  /// As RequestStop, without waiting for the last round: the thread may outlive this object, so
  /// rounds own all that they use. Only with a thread of its own.
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

/// Runs `work` on a thread that may outlive main(), without waiting for it: for a call that may
/// hang. The error: the system has no thread left.
Status StartDetached(const std::string& name, std::function<void()> work);

/// Items that wait for a worker, first in, first out. If there is no room for an item, it is
/// dropped and counted. From any thread.
template <typename Item>
class WorkQueue {
 public:
  explicit WorkQueue(std::size_t most) : most_(most) {}

  /// False: there was no room.
  bool Put(Item&& item) {
    const MutexLock lock(mutex_);
    if (items_.size() >= most_) {
      ++dropped_;
      return false;
    }
    items_.push_back(std::move(item));
    return true;
  }
  /// The oldest. Empty: none waits.
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
