// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/live/run.h"

#include <malloc.h>
#include <signal.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <system_error>

#include "config/copies.h"
#include "config/loader.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/log.h"
#include "gateway/base/version.h"
#include "gateway/base/whole_file.h"
#include "gateway/base/worker.h"
#include "gateway/daemon/daemon.h"
#include "gateway/daemon/reload/trial.h"
#include "gateway/records/disk/state_folder.h"
#include "gateway/tools/cli/offline/check.h"

namespace baudgate {

namespace {

constexpr auto kLookEvery = 1000ms;
/// Below TimeoutStopSec of the service.
constexpr auto kStopWithin = 4s;

/// A tenth of WatchdogSec, a second at most; systemd gets nine tries to be late.
timespec LookInterval(std::uint64_t watchdog_us) {
  auto interval = std::chrono::microseconds(kLookEvery);
  if (watchdog_us > 0) interval = std::min(interval, std::chrono::microseconds(watchdog_us) / 10);
  return {interval / 1s, std::chrono::nanoseconds(interval % 1s).count()};
}

/// The sign of life is this thread's: a thread that hangs, this one too, keeps it back.
void WaitForStop(const sigset_t& signals, Daemon& daemon) {
  std::uint64_t watchdog_us = 0;
  const bool watched = sd_watchdog_enabled(0, &watchdog_us) > 0;
  const timespec interval = LookInterval(watched ? watchdog_us : 0);
  for (;;) {
    const int caught = sigtimedwait(&signals, nullptr, &interval);
    if (caught == SIGTERM || caught == SIGINT) return;
    if (caught == SIGHUP) daemon.Reload("SIGHUP");
    if (daemon.Look() && watched) sd_notify(0, "WATCHDOG=1");
  }
}

Result<std::string> ReadText(const std::string& file, Kind kind = Kind::regular) {
  auto text = ReadWhole(file, kind);
  if (!text) return Error{std::string("cannot be read: ") + std::strerror(errno)};
  return *std::move(text);
}

/// A pipe, which a start takes, would keep a reload waiting for whoever writes to it.
Result<std::string> ReadAgain(const std::string& file) {
  std::error_code gone;
  const auto kind = std::filesystem::status(file, gone).type();
  const bool other = !gone && kind != std::filesystem::file_type::regular;
  if (other) return Error{"is no regular file, and can only be read at a start"};
  return ReadText(file);
}

std::vector<std::string> ProblemsOf(const config::Loaded& loaded) {
  std::vector<std::string> all;
  for (const config::Problem& problem : loaded.problems) all.push_back(ToString(problem));
  return all;
}

/// What a gateway starts with: the file, or what was confirmed before it was refused.
struct Choice {
  config::Loaded loaded;
  ReloadOptions reload;
};

ReloadOptions ReloadOf(const std::string& file, const config::Catalog& catalog) {
  ReloadOptions reload;
  reload.file = file;
  reload.read = [file] { return ReadAgain(file); };
  reload.load = [file, &catalog](const std::string& text) {
    config::Loaded loaded = config::LoadText(text, file, catalog);
    std::vector<std::string> problems = ProblemsOf(loaded);
    if (!loaded.ok()) return LoadedText{{}, std::move(problems)};
    return LoadedText{std::move(loaded.config), std::move(problems)};
  };
  reload.masked = [&catalog](const std::string& running) {
    return config::MaskedConfig(running, config::SecretKeys(catalog));
  };
  reload.notify = [](const std::string& state) { sd_notify(0, state.c_str()); };
  return reload;
}

Choice Choose(const std::string& file, const config::Catalog& catalog, std::ostream& err) {
  Choice choice{.loaded = {}, .reload = ReloadOf(file, catalog)};
  ReloadOptions& reload = choice.reload;
  const auto text = ReadText(file, Kind::any);
  choice.loaded = text ? config::LoadText(*text, file, catalog) : config::LoadFile(file, catalog);
  PrintProblems(choice.loaded.problems, err);
  if (!text || !choice.loaded.ok()) return choice;
  reload.text_at_start = *text;
  const config::Config& config = choice.loaded.config;
  const auto folder = StateFolderOf(StatePlaces::Here(config.state), config.name);
  if (folder.empty()) return choice;
  reload.kept.emplace(folder / reload::KeptConfigs::kFolder);
  if (!reload.kept->IsUnconfirmed(*text)) {
    if (reload.kept->trial() == reload::KeptConfigs::Trial::running) {
      err << "baudgate: a configuration was on trial when the gateway ended and was never "
             "confirmed; "
          << file << " has been edited since, and runs as confirmed\n";
    }
    return choice;
  }
  const std::string copy = reload.kept->confirmed_file().string();
  const auto confirmed = ReadText(copy);
  reload.refused = reload::Refused{*text, reload.kept->why_taken_back()};
  err << "baudgate: " << reload::TakenBack(file, reload.refused->why) << '\n';
  if (confirmed) {
    reload.text_at_start = *confirmed;
    choice.loaded = config::LoadText(*confirmed, file, catalog);
  } else {
    choice.loaded.problems = {{{copy, 0, 0}, confirmed.error(), false}};
  }
  PrintProblems(choice.loaded.problems, err);
  if (!choice.loaded.ok()) {
    err << "baudgate: the confirmed configuration " << copy << " cannot be run; change " << file
        << ", and the next start uses it\n";
  }
  return choice;
}

/// Ends the process when its stop takes too long: a file, a disk or a driver does not answer.
class StopGuard {
 public:
  StopGuard()
      : worker_("stop guard", [until = ReadClocks().instant + kStopWithin](bool stopped) {
          if (stopped || ReadClocks().instant < until) return until;
          log::Fail(
              "the stop takes longer than {} s: a file, a disk or a driver does not answer; "
              "the gateway ends without it",
              kStopWithin / 1s);
          log::Flush();
          std::_Exit(kExitCanNot);
        }) {
    worker_.Start();
  }

 private:
  Worker worker_;
};

/// Before any thread starts, so that all of them inherit it and only this one takes them.
sigset_t BlockSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // SIGXFSZ: a write beyond a limit of file sizes fails, as on a full disk.
  for (const int ignored : {SIGPIPE, SIGUSR1, SIGUSR2, SIGXFSZ}) signal(ignored, SIG_IGN);
  return signals;
}

}  // namespace

int Serve(config::Config config, std::optional<ReloadOptions> reload,
          const config::Catalog& catalog) try {
  const sigset_t signals = BlockSignals();
  std::optional<StopGuard> stop_guard;  // ends after the gateway, whose end it guards
  Daemon daemon(std::move(config), catalog);
  if (reload) {
    reload->summary = [&daemon] { return daemon.Summary(); };
    daemon.SetReload(std::move(*reload));
  }
  if (const Status status = daemon.Start(); !status) {
    log::Plain("baudgate: " + status.error() + "\n");
    return kExitCanNot;
  }
  log::Info("baudgate {} runs: {}", kVersion, daemon.Summary());
  sd_notifyf(0, "READY=1\nSTATUS=%s", daemon.Summary().c_str());

  WaitForStop(signals, daemon);
  stop_guard.emplace();
  sd_notify(0, "STOPPING=1");
  log::Info("baudgate stops");
  // Without destructors: they would wait for the driver.
  if (!daemon.Stop()) {
    log::Flush();
    std::_Exit(0);
  }
  return kExitDone;
} catch (const std::system_error& failed) {
  log::Plain(
      "baudgate: the system has no file descriptor or no thread left: " + failed.code().message() +
      "; raise LimitNOFILE and TasksMax of the service (ulimit -n, ulimit -u)\n");
  return kExitCanNot;
}

int RunDaemon(const std::string& file, const config::Catalog& catalog) {
  // A file that is a pipe may keep this waiting for its writer: SIGTERM and SIGINT end it. A reload
  // waits until there is something to reload.
  sigset_t later;
  sigemptyset(&later);
  sigaddset(&later, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &later, nullptr);
  std::ostringstream problems;
  Choice choice = Choose(file, catalog, problems);
  log::Plain(problems.str());
  if (!choice.loaded.ok()) return kExitBadConfiguration;
  // A large file leaves hundreds of megabytes of the parser's nodes behind, free and not given
  // back.
  ::malloc_trim(0);
  return Serve(std::move(choice.loaded.config), std::move(choice.reload), catalog);
}

}  // namespace baudgate
