// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/log_outlet.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <deque>
#include <string_view>
#include <system_error>
#include <utility>

namespace baudgate::log {

struct Outlet::Queue {
  Queue(int to, std::size_t most) : descriptor(to), most_bytes(most) {}

  const int descriptor;
  const std::size_t most_bytes;
  Mutex mutex;
  std::condition_variable written;
  std::deque<std::string> lines BAUDGATE_GUARDED_BY(mutex);
  std::size_t bytes BAUDGATE_GUARDED_BY(mutex) = 0;
  std::uint64_t dropped BAUDGATE_GUARDED_BY(mutex) = 0;
  std::uint64_t told BAUDGATE_GUARDED_BY(mutex) = 0;  // of `dropped`
  bool writing BAUDGATE_GUARDED_BY(mutex) = false;
};

namespace {

/// Waits as long as the reader lets it wait. False: the descriptor fails.
bool WriteAll(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t taken = ::write(descriptor, text.data(), text.size());
    if (taken > 0) {
      text.remove_prefix(static_cast<std::size_t>(taken));
    } else if (taken < 0 && errno == EAGAIN) {
      pollfd room{descriptor, POLLOUT, 0};
      ::poll(&room, 1, -1);
    } else if (taken == 0 || errno != EINTR) {
      return false;
    }
  }
  return true;
}

std::string DroppedText(std::uint64_t lines) {
  return fmt::format("{} lines of the log were dropped here, because nobody read it\n", lines);
}

}  // namespace

Outlet::Outlet(int descriptor, std::size_t most_bytes)
    : queue_(std::make_shared<Queue>(descriptor, most_bytes)),
      worker_("log", [queue = queue_](bool) {
        WriteQueued(*queue);
        return kWhenWoken;
      }) {
  try {
    worker_.Start();
  } catch (const std::system_error&) {
    has_thread_ = false;
  }
}

Outlet::~Outlet() { worker_.Leave(); }

void Outlet::Put(std::string line) {
  {
    const MutexLock lock(queue_->mutex);
    if (!has_thread_) {
      queue_->dropped += WriteAll(queue_->descriptor, line) ? 0 : 1;
      return;
    }
    if (queue_->bytes + line.size() > queue_->most_bytes) {
      ++queue_->dropped;
      return;
    }
    queue_->bytes += line.size();
    queue_->lines.push_back(std::move(line));
  }
  worker_.Wake();
}

bool Outlet::Flush(Duration patience) {
  const auto until = std::chrono::steady_clock::now() + patience;
  MutexLock lock(queue_->mutex);
  while (queue_->writing || !queue_->lines.empty()) {
    if (!lock.WaitUntil(queue_->written, until)) return false;
  }
  return true;
}

std::uint64_t Outlet::dropped() const {
  const MutexLock lock(queue_->mutex);
  return queue_->dropped;
}

void Outlet::WriteQueued(Queue& queue) {
  for (;;) {
    std::string text;
    {
      const MutexLock lock(queue.mutex);
      if (queue.lines.empty()) return;
      text = std::move(queue.lines.front());
      queue.lines.pop_front();
      queue.bytes -= text.size();
      queue.writing = true;
    }
    const bool written = WriteAll(queue.descriptor, text);
    std::string note;
    {
      const MutexLock lock(queue.mutex);
      if (!written) ++queue.dropped;
      // Lines were dropped behind all that are queued now.
      if (queue.lines.empty() && queue.dropped > queue.told) {
        note = DroppedText(queue.dropped - queue.told);
        queue.told = queue.dropped;
      }
      if (note.empty()) queue.writing = false;
    }
    if (!note.empty()) {
      WriteAll(queue.descriptor, note);
      const MutexLock lock(queue.mutex);
      queue.writing = false;
    }
    queue.written.notify_all();
  }
}

}  // namespace baudgate::log
