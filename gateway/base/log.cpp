// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/log.h"

#include <fmt/chrono.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string_view>
#include <system_error>

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

std::atomic<Level> g_least = Level::info;

std::unique_ptr<Journal> g_journal;

/// Made by Begin and never destroyed, because objects that are destroyed at exit may still log.
Outlet* g_outlet = nullptr;

/// Returns "2024-05-06 12:01:05.042 warning line bay: device relay: offline", in local time.
std::string LineOf(Level level, const std::string& text) {
  constexpr std::string_view kLevels[] = {"debug", "info", "warning", "error"};
  const auto now =
      std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} {:<7} {}\n", fmt::localtime(seconds),
                     now.time_since_epoch().count() % 1000,
                     kLevels[static_cast<std::size_t>(level)], text);
}

/// Prints a line. If the journal does not accept the line, it goes to standard error with its
/// priority ("<4>text"). Without Begin (only tests do not call it), lines go to standard output.
void Print(Level level, const About& about, const std::string& text) {
  if (level < g_least || (g_journal && g_journal->Send(level, about, text))) return;
  std::string line =
      g_journal ? fmt::format("<{}>{}\n", Priority(level), text) : LineOf(level, text);
  if (g_outlet != nullptr) return g_outlet->Put(std::move(line));
  std::fputs(line.c_str(), stdout);
  std::fflush(stdout);
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

/// Teller writes repeats that were held back when their minute is over, even if nothing else is
/// logged then.
class Teller {
 public:
  Teller() {
    try {
      worker_.Start();
    } catch (const std::system_error&) {
      // No thread can be started, so repeats are written before the next text.
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
  // This static is created at the first repeat, after the static Folder of TheFolder, so it is
  // destroyed before the Folder.
  static Teller teller;
}

}  // namespace

/// Returns the text with the times in front. A line that began with the text would look as if the
/// text had come now.
std::string RepeatText(const Folder::Repeat& repeat) {
  const auto shown = [](const Now& at) {
    const std::time_t time = std::chrono::system_clock::to_time_t(
        std::chrono::time_point_cast<std::chrono::system_clock::duration>(at.wall));
    return fmt::format("{:%H:%M:%S}", fmt::localtime(time));
  };
  if (repeat.times == 1)
    return fmt::format("repeated once at {}: {}", shown(repeat.last), repeat.text);
  return fmt::format("repeated {} times between {} and {}: {}", repeat.times, shown(repeat.first),
                     shown(repeat.last), repeat.text);
}

void Begin(Level least, const std::string& socket) {
  g_journal = IsJournal(STDERR_FILENO) ? std::make_unique<Journal>(socket) : nullptr;
  if (g_outlet == nullptr) {
    g_outlet = new Outlet(STDERR_FILENO);
    std::atexit(Flush);
  }
  g_least = least;
}

void SetLeast(Level least) { g_least = least; }

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

void Write(Level level, const About& about, const std::string& key, const std::string& text) {
  PrintOrHold(&key, level, about, Whole(about, text));
}

void WriteAct(Level level, const std::string& text) { Print(level, {}, text); }

void WriteAct(Level level, const About& about, const std::string& text) {
  Print(level, about, Whole(about, text));
}

}  // namespace baudgate::log
