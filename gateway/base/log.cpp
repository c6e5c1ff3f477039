// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/log.h"

#include <fmt/chrono.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <memory>
#include <mutex>
#include <system_error>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/log_outlet.h"
#include "gateway/base/time.h"
#include "gateway/base/worker.h"

namespace baudgate::log {
namespace {

constexpr auto kLookEvery = 5s;
constexpr auto kFlushAtMost = 500ms;

Mutex g_mutex;

Folder& TheFolder() BAUDGATE_REQUIRES(g_mutex) {
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

/// Empty: standard error is not the journal.
std::unique_ptr<Journal> g_journal;

/// Made by Begin, and never destroyed: whoever logs last still finds it.
Outlet* g_outlet = nullptr;

/// The form of a line is spdlog's, the way out is the outlet's.
class OutletSink : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    g_outlet->Put(fmt::to_string(line));
  }
  void flush_() override {}
};

/// A journal that takes nothing just now gets the line as any program's standard error does.
void Print(Level level, const About& about, const std::string& text) {
  const auto weight = LevelOf(level);
  if (!g_journal) return spdlog::log(weight, "{}", text);
  if (!spdlog::should_log(weight) || g_journal->Send(level, about, text)) return;
  spdlog::log(weight, "<{}>{}", Priority(level), text);
}

using Repeats = std::vector<Folder::Repeat>;

void PrintRepeats(const Repeats& repeats) {
  for (const Folder::Repeat& repeat : repeats) {
    Print(repeat.level, repeat.about, RepeatText(repeat));
  }
}

void PrintRepeats(Repeats (Folder::*take)(Instant)) {
  Repeats repeats;
  {
    const MutexLock lock(g_mutex);
    repeats = (TheFolder().*take)(ReadClocks().instant);
  }
  PrintRepeats(repeats);
}

/// Tells of repeats when their minute is over, although nobody writes to the log any more.
class Teller {
 public:
  Teller() {
    try {
      worker_.Start();
    } catch (const std::system_error&) {
      // No thread is left for it: repeats are told with the next text.
    }
  }

 private:
  Worker worker_{"log repeats", [](bool last) {
                   if (!last) PrintRepeats(&Folder::Due);
                   return ReadClocks().instant + kLookEvery;
                 }};
};

std::string Whole(const About& about, const std::string& text) {
  return (about.line.empty() ? "" : "line " + about.line + ": ") +
         (about.device.empty() ? "" : "device " + about.device + ": ") + text;
}

/// Prints or holds back a text: repeats that are due go before it.
void PrintOrHold(const std::string* key, Level level, const About& about, const std::string& text) {
  Repeats due;
  bool passed = false;
  {
    const MutexLock lock(g_mutex);
    const Now now = ReadClocks();
    due = TheFolder().Due(now.instant);
    passed = key == nullptr ? TheFolder().Pass(text, level, now, about)
                            : TheFolder().Pass(*key, text, level, now);
  }
  PrintRepeats(due);
  if (passed) return Print(level, about, text);
  // Made with the first repeat, long after the log it prints to, and therefore gone before it.
  static Teller teller;
}

}  // namespace

/// The times stand first: a line that began with the text would read as if it had come now.
std::string RepeatText(const Folder::Repeat& repeat) {
  const auto shown = [](const Now& at) {
    const std::time_t time = std::chrono::system_clock::to_time_t(
        std::chrono::time_point_cast<std::chrono::system_clock::duration>(at.wall));
    return fmt::format("{:%H:%M:%S}", fmt::localtime(time));
  };
  if (repeat.times == 1) return fmt::format("once more at {}: {}", shown(repeat.last), repeat.text);
  return fmt::format("{} times more between {} and {}: {}", repeat.times, shown(repeat.first),
                     shown(repeat.last), repeat.text);
}

void Begin(Level least, const std::string& socket) {
  if (IsJournal(STDERR_FILENO)) g_journal = std::make_unique<Journal>(socket);
  if (g_outlet == nullptr) {
    g_outlet = new Outlet(STDERR_FILENO);
    std::atexit(Flush);
  }
  auto logger = std::make_shared<spdlog::logger>("baudgate", std::make_shared<OutletSink>());
  logger->set_pattern(g_journal ? "%v" : "%Y-%m-%d %H:%M:%S.%e %-7l %v");
  logger->set_level(LevelOf(least));
  spdlog::set_default_logger(std::move(logger));
}

void SetLeast(Level least) { spdlog::default_logger()->set_level(LevelOf(least)); }

void Plain(const std::string& text) {
  if (g_outlet != nullptr) g_outlet->Put(text);
}

void Flush() {
  if (g_outlet != nullptr) g_outlet->Flush(kFlushAtMost);
}

std::uint64_t Dropped() { return g_outlet == nullptr ? 0 : g_outlet->dropped(); }

void TellRepeats() { PrintRepeats(&Folder::All); }

void ForgetRepeats() {
  const MutexLock lock(g_mutex);
  TheFolder() = Folder();
}

void Write(Level level, const std::string& text) { Write(level, About{}, text); }

void Write(Level level, const About& about, const std::string& text) {
  PrintOrHold(nullptr, level, about, Whole(about, text));
}

void Write(Level level, const std::string& key, const std::string& text) {
  PrintOrHold(&key, level, {}, text);
}

void WriteAct(Level level, const std::string& text) { Print(level, {}, text); }

void WriteAct(Level level, const About& about, const std::string& text) {
  Print(level, about, Whole(about, text));
}

}  // namespace baudgate::log
