// SPDX-License-Identifier: Apache-2.0
#include "gateway/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "gateway/base/time.h"

namespace baudgate::log {
namespace {

constexpr std::size_t kRemembered = 256;

/// Counts texts that came within the last minute, so that a flapping device writes one line a
/// minute.
class Folder {
 public:
  /// How often the text was held back since it was last written; nothing: hold it back now too.
  std::optional<int> Pass(const std::string& text, Instant now) {
    const std::lock_guard lock(mutex_);
    if (seen_.size() > kRemembered) {
      std::erase_if(seen_, [now](const auto& entry) { return now - entry.second.written > 1min; });
      if (seen_.size() > kRemembered) seen_.clear();
    }
    const auto [entry, is_new] = seen_.try_emplace(text, Seen{now, 0});
    if (is_new) return 0;
    if (now - entry->second.written < 1min) {
      ++entry->second.held_back;
      return std::nullopt;
    }
    entry->second.written = now;
    return std::exchange(entry->second.held_back, 0);
  }

 private:
  struct Seen {
    Instant written;
    int held_back = 0;
  };
  std::mutex mutex_;
  std::map<std::string, Seen> seen_;
};

Folder& TheFolder() {
  static Folder folder;
  return folder;
}

spdlog::level::level_enum LevelOf(Level level) {
  switch (level) {
    case Level::debug:
      return spdlog::level::debug;
    case Level::info:
      return spdlog::level::info;
    case Level::warning:
      return spdlog::level::warn;
    case Level::error:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

/// "<4>": what journald takes for the priority of a line on standard error.
std::string_view Priority(Level level) {
  switch (level) {
    case Level::debug:
      return "<7>";
    case Level::info:
      return "<6>";
    case Level::warning:
      return "<4>";
    case Level::error:
      return "<3>";
  }
  return "<6>";
}

bool g_journal = false;

}  // namespace

void Begin(Level least) {
  g_journal = std::getenv("JOURNAL_STREAM") != nullptr;
  auto logger = spdlog::stderr_logger_mt("baudgate");
  logger->set_pattern(g_journal ? "%v" : "%Y-%m-%d %H:%M:%S.%e %-7l %v");
  logger->set_level(LevelOf(least));
  logger->flush_on(spdlog::level::trace);
  spdlog::set_default_logger(std::move(logger));
}

void SetLeast(Level least) { spdlog::default_logger()->set_level(LevelOf(least)); }

void Write(Level level, const std::string& text) {
  const auto held_back = TheFolder().Pass(text, std::chrono::steady_clock::now());
  if (!held_back) return;
  std::string line = g_journal ? std::string(Priority(level)) + text : text;
  if (*held_back > 0) line += fmt::format(" ({} more times in the last minute)", *held_back);
  spdlog::log(LevelOf(level), "{}", line);
}

}  // namespace baudgate::log
