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
#include "gateway/base/journal.h"
#include "gateway/base/log_folder.h"
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

void PrintRepeats(Repeats (Folder::*take)(Instant)) {
  Repeats repeats;
  {
    const MutexLock lock(g_mutex);
    repeats = (TheFolder().*take)(std::chrono::steady_clock::now());
  }
  for (const Folder::Repeat& repeat : repeats) {
    const std::time_t last = std::chrono::system_clock::to_time_t(
        std::chrono::time_point_cast<std::chrono::system_clock::duration>(repeat.last.wall));
    Print(repeat.level, repeat.about,
          fmt::format("{} ({} more, the last at {:%H:%M:%S})", repeat.text, repeat.times,
                      fmt::localtime(last)));
  }
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

void PrintOrHold(bool passed, Level level, const About& about, const std::string& text) {
  if (passed) return Print(level, about, text);
  // Made with the first repeat, long after the log it prints to, and therefore gone before it.
  static Teller teller;
}

}  // namespace

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
  const std::string whole = Whole(about, text);
  bool passed = false;
  {
    const MutexLock lock(g_mutex);
    passed = TheFolder().Pass(whole, level, ReadClocks(), about);
  }
  PrintOrHold(passed, level, about, whole);
}

void Write(Level level, const std::string& key, const std::string& text) {
  bool passed = false;
  {
    const MutexLock lock(g_mutex);
    passed = TheFolder().Pass(key, text, level, ReadClocks());
  }
  PrintOrHold(passed, level, {}, text);
}

void WriteAct(Level level, const std::string& text) { Print(level, {}, text); }

void WriteAct(Level level, const About& about, const std::string& text) {
  Print(level, about, Whole(about, text));
}

}  // namespace baudgate::log
