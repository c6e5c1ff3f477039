// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/log_outlet.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <string_view>
#include <system_error>
#include <utility>

namespace baudgate::log {
namespace {

/// Appends one field of the journal's protocol. A value of several lines follows a line feed and
/// its length: eight bytes, least significant first.
void AddField(std::string& message, const std::string& name, const std::string& value) {
  if (value.empty()) return;
  message += name;
  if (value.find('\n') == std::string::npos) {
    message += '=';
  } else {
    message += '\n';
    for (unsigned shift = 0; shift < 64; shift += 8) {
      message += static_cast<char>((static_cast<std::uint64_t>(value.size()) >> shift) & 0xFF);
    }
  }
  message += value + "\n";
}

}  // namespace

int Priority(Level level) {
  constexpr int kPriorities[] = {7, 6, 4, 3};
  return kPriorities[static_cast<std::size_t>(level)];
}

bool IsJournal(int descriptor) {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat info {};
  if (stream == nullptr || ::fstat(descriptor, &info) != 0) return false;
  return fmt::format("{}:{}", info.st_dev, info.st_ino) == stream;
}

std::string JournalMessage(Level level, const About& about, const std::string& text) {
  std::string message;
  AddField(message, "MESSAGE", text);
  AddField(message, "PRIORITY", std::to_string(Priority(level)));
  AddField(message, "SYSLOG_IDENTIFIER", "baudgate");
  AddField(message, "LINE", about.line);
  AddField(message, "DEVICE", about.device);
  AddField(message, "OUTCOME", about.outcome);
  for (const auto& [name, value] : about.fields) AddField(message, name, value);
  return message;
}

Journal::Journal(std::string socket)
    : path_(std::move(socket)), socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}

Journal::~Journal() {
  if (socket_ >= 0) ::close(socket_);
}

bool Journal::Send(Level level, const About& about, const std::string& text) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.size() >= sizeof address.sun_path) return false;
  path_.copy(address.sun_path, path_.size());
  const std::string message = JournalMessage(level, about, text);
  const auto* to = reinterpret_cast<const sockaddr*>(&address);
  return ::sendto(socket_, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL, to,
                  sizeof address) == static_cast<ssize_t>(message.size());
}

struct Outlet::Queue {
  Queue(int to, std::size_t most) : descriptor(to), most_bytes(most) {}

  const int descriptor;
  const std::size_t most_bytes;
  Mutex mutex;
  std::condition_variable written;
  std::deque<std::string> lines BAUDGATE_GUARDED_BY(mutex);
  std::size_t bytes BAUDGATE_GUARDED_BY(mutex) = 0;
  std::uint64_t dropped BAUDGATE_GUARDED_BY(mutex) = 0;
  // The number of dropped lines that have been reported.
  std::uint64_t told BAUDGATE_GUARDED_BY(mutex) = 0;
  bool writing BAUDGATE_GUARDED_BY(mutex) = false;
};

namespace {

/// Writes all of `text`, and blocks as long as the reader does. Returns false if writing fails.
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
  return fmt::format("{} log lines were dropped here, because the log was not read in time\n",
                     lines);
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
      // The number of dropped lines is reported when the queue is empty, so that it comes last.
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
