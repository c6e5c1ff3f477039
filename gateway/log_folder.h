// Counts log texts that come again within a minute, so that a flapping device does not flood the
// log: texts and times come from gateway/log.cpp, and what may be written goes back there.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/log.h"

namespace baudgate::log {

/// Not thread-safe.
class Folder {
 public:
  struct Repeat {
    std::string text;
    Level level = Level::info;
    int times = 0;
    Now last;
  };

  /// True: write it. False: the same text was written less than a minute ago; it is held back.
  bool Pass(const std::string& text, Level level, const Now& now) {
    if (seen_.size() >= kRemembered) Forget(now.instant);
    const auto [entry, is_new] = seen_.try_emplace(text, Seen{now.instant, {text, level, 0, now}});
    Seen& seen = entry->second;
    if (is_new) return true;
    if (now.instant - seen.written < kMinute) {
      ++seen.held.times;
      seen.held.last = now;
      return false;
    }
    // Repeats that nobody has fetched yet are told by Due; this one is written now.
    seen.written = now.instant;
    return true;
  }

  /// The held back texts, the latest last, once a minute has passed for any of them. All at once:
  /// so the end of the log tells the state in which things are.
  std::vector<Repeat> Due(Instant now) {
    const auto is_due = [now](const auto& entry) {
      return entry.second.held.times > 0 && now - entry.second.written >= kMinute;
    };
    std::vector<Repeat> due;
    if (std::none_of(seen_.begin(), seen_.end(), is_due)) return due;
    for (auto& [text, seen] : seen_) {
      if (seen.held.times == 0) continue;
      due.push_back(seen.held);
      seen.held.times = 0;
      seen.written = now;
    }
    std::sort(due.begin(), due.end(),
              [](const Repeat& a, const Repeat& b) { return a.last.instant < b.last.instant; });
    return due;
  }

 private:
  static constexpr std::size_t kRemembered = 256;
  static constexpr Duration kMinute = 1min;

  struct Seen {
    Instant written;
    Repeat held;
  };

  /// Texts with repeats that are not told yet stay, as long as there is room for the others.
  void Forget(Instant now) {
    std::erase_if(seen_, [now](const auto& entry) {
      return entry.second.held.times == 0 && now - entry.second.written >= kMinute;
    });
    if (seen_.size() >= kRemembered) seen_.clear();
  }

  std::map<std::string, Seen> seen_;
};

}  // namespace baudgate::log
