// `Outlet` writes log lines to a descriptor that may block, such as a pipe that is not read or a
// stopped terminal. A separate thread writes; the caller only queues a line, and never waits.
// `Folder` counts repeated texts, and `Journal` writes to systemd's journal.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gateway/base/log.h"
#include "gateway/base/time.h"
#include "gateway/base/worker.h"

namespace baudgate::log {

/// Counts log texts that come again within a minute, so that a flapping device does not flood the
/// log. Not thread-safe.
class Folder {
 public:
  struct Repeat {
    std::string text;
    Level level = Level::info;
    int times = 0;
    Now first;
    Now last;
    About about{};
  };

  /// Returns true if the caller must write the text, after the texts of Due(). Returns false, and
  /// holds the text back, if it was written less than a minute ago.
  bool Pass(const std::string& text, Level level, const Now& now, const About& about = {}) {
    // If there is no room to remember the text, it is written every time. This is rare, because
    // these texts name only configured lines and devices.
    if (!HasRoom(text, kRemembered, now.instant)) return true;
    return Note(text, text, level, now, about);
  }

  /// Like the Pass above, but compares keys instead of texts. Keys can name unknown clients without
  /// limit, so all keys beyond kMostWithKeys share one entry.
  bool Pass(const std::string& key, const std::string& text, Level level, const Now& now) {
    return Note(HasRoom(key, kMostWithKeys, now.instant) ? key : "", text, level, now, {});
  }

  /// Returns nothing until a minute has passed for one of the texts held back; then returns all
  /// texts held back, the latest last, so that the end of the log shows the current state.
  std::vector<Repeat> Due(Instant now) {
    const auto is_due = [now](const auto& entry) {
      return entry.second.held.times > 0 && now - entry.second.written >= kMinute;
    };
    if (std::none_of(seen_.begin(), seen_.end(), is_due)) return {};
    return All(now);
  }

  /// Returns all held back texts, the latest last, and forgets their counts.
  std::vector<Repeat> All(Instant now) {
    std::vector<Repeat> held;
    for (auto& [key, seen] : seen_) {
      if (seen.held.times == 0) continue;
      held.push_back(seen.held);
      seen.held.times = 0;
      seen.written = now;
    }
    std::sort(held.begin(), held.end(),
              [](const Repeat& a, const Repeat& b) { return a.last.instant < b.last.instant; });
    return held;
  }

 private:
  static constexpr std::size_t kRemembered = 256;
  static constexpr std::size_t kMostWithKeys = kRemembered / 2;
  static constexpr Duration kMinute = 1min;

  struct Seen {
    Instant written;
    Repeat held;
  };

  bool Note(const std::string& key, const std::string& text, Level level, const Now& now,
            const About& about) {
    const auto [entry, is_new] =
        seen_.try_emplace(key, Seen{now.instant, {text, level, 0, now, now, about}});
    Seen& seen = entry->second;
    if (is_new) return true;
    if (now.instant - seen.written < kMinute) {
      const Now first = seen.held.times == 0 ? now : seen.held.first;
      seen.held = {text, level, seen.held.times + 1, first, now, about};
      return false;
    }
    seen.written = now.instant;
    return true;
  }

  /// Erases texts whose minute is over and whose repeats were written. False: there is no room for
  /// a new key.
  bool HasRoom(const std::string& key, std::size_t most, Instant now) {
    if (seen_.size() < most || seen_.contains(key)) return true;
    std::erase_if(seen_, [now](const auto& entry) {
      return entry.second.held.times == 0 && now - entry.second.written >= kMinute;
    });
    return seen_.size() < most;
  }

  std::map<std::string, Seen> seen_;  // key: the text, or its key
};

/// Returns "3 times more between 12:01:05 and 12:01:58: line bay: device relay: offline", in local
/// time.
std::string RepeatText(const Folder::Repeat& repeat);

/// Forgets all texts, for tests that count lines.
void ForgetRepeats();

// systemd's journal takes one datagram with fields per message (systemd's "Native Journal
// Protocol").

/// Returns the priority of the journal: 3 error, 4 warning, 6 info, 7 debug.
int Priority(Level level);

/// True if systemd has connected this descriptor to the journal: device and inode are those in
/// $JOURNAL_STREAM. A program that inherited the variable, but writes elsewhere, gets false.
bool IsJournal(int descriptor);

/// Returns "MESSAGE=line bay: device relay: offline\nPRIORITY=4\nLINE=bay\nDEVICE=relay\n…".
std::string JournalMessage(Level level, const About& about, const std::string& text);

class Journal {
 public:
  explicit Journal(std::string socket);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Sends a message without blocking. False: there is no journal, or its socket is full.
  /// Thread-safe.
  bool Send(Level level, const About& about, const std::string& text) const;

 private:
  const std::string path_;
  const int socket_;
};

/// Queues lines and writes them in a thread. A line for which the queue of `most_bytes` has no room
/// is dropped; when the reader reads again, the number of dropped lines is written. Thread-safe.
class Outlet {
 public:
  static constexpr std::size_t kMostBytes = 256 * 1024;

  explicit Outlet(int descriptor, std::size_t most_bytes = kMostBytes);
  /// Does not wait for the thread, which the reader can block.
  ~Outlet();
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;

  /// Queues `line`, which ends with a line feed.
  void Put(std::string line);
  /// Waits until all lines are written, at most for `patience`. Returns false if lines remain.
  bool Flush(Duration patience);
  std::uint64_t dropped() const;

 private:
  struct Queue;
  static void WriteQueued(Queue& queue);

  // Shared with the thread, which may live longer than this object.
  const std::shared_ptr<Queue> queue_;
  Worker worker_;
  bool has_thread_ = true;  // false: no thread could be started, so the caller of Put writes
};

}  // namespace baudgate::log
