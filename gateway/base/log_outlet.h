// Writes log lines to a descriptor that may block: a pipe that is not read, a stopped terminal. A
// thread of its own writes; the caller only queues a line, and never waits. Folder counts texts
// that come again, and Journal writes to systemd's journal.
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

// Counts log texts that come again within a minute, so that a flapping device does not flood the
// log: texts and times come from gateway/base/log.cpp, and what may be written goes back there.

/// Not thread-safe.
class Folder {
 public:
  /// A text that was held back `times` times.
  struct Repeat {
    std::string text;
    Level level = Level::info;
    int times = 0;
    Now first;
    Now last;
    About about{};
  };

  /// True: write it. False: the same text was written less than a minute ago; it is held back.
  /// The caller writes what is Due first, so that no older repeat follows.
  bool Pass(const std::string& text, Level level, const Now& now, const About& about = {}) {
    // Written at least; such texts name what is configured, so there is an end of them.
    if (!HasRoom(text, kRemembered, now.instant)) return true;
    return Note(text, text, level, now, about);
  }

  /// Alike, with the key in the place of the text. Keys may name strangers, of whom there is no
  /// end: those that are too many share one entry.
  bool Pass(const std::string& key, const std::string& text, Level level, const Now& now) {
    return Note(HasRoom(key, kMostWithKeys, now.instant) ? key : "", text, level, now, {});
  }

  /// The held back texts, the latest last, once a minute has passed for any of them. All at once:
  /// so the end of the log tells the state in which things are.
  std::vector<Repeat> Due(Instant now) {
    const auto is_due = [now](const auto& entry) {
      return entry.second.held.times > 0 && now - entry.second.written >= kMinute;
    };
    if (std::none_of(seen_.begin(), seen_.end(), is_due)) return {};
    return All(now);
  }

  /// Alike, whether a minute has passed or not.
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

  /// Repeats that are not told yet are never forgotten.
  bool HasRoom(const std::string& key, std::size_t most, Instant now) {
    if (seen_.size() < most || seen_.contains(key)) return true;
    std::erase_if(seen_, [now](const auto& entry) {
      return entry.second.held.times == 0 && now - entry.second.written >= kMinute;
    });
    return seen_.size() < most;
  }

  std::map<std::string, Seen> seen_;  // by key
};

/// "3 times more between 12:01:05 and 12:01:58: line bay: device relay: offline", in local time.
std::string RepeatText(const Folder::Repeat& repeat);

/// As if this process had written nothing yet: for tests that count lines, whatever ran before.
void ForgetRepeats();

// systemd's journal as a place for the log: a datagram for each message, with fields (systemd's
// "Native Journal Protocol").

/// What journald calls it: 3 error, 4 warning, 6 info, 7 debug.
int Priority(Level level);

/// Descriptors that systemd has connected to the journal, as $JOURNAL_STREAM says; not when the
/// variable was only inherited by a program whose output goes elsewhere.
bool IsJournal(int descriptor);

/// "MESSAGE=line bay: device relay: offline\nPRIORITY=4\nLINE=bay\nDEVICE=relay\n…"
std::string JournalMessage(Level level, const About& about, const std::string& text);

class Journal {
 public:
  explicit Journal(std::string socket);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Does not block; thread-safe. False: there is no journal, or its socket is full.
  bool Send(Level level, const About& about, const std::string& text) const;

 private:
  const std::string path_;
  const int socket_;
};

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
