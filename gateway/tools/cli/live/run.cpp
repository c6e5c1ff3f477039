// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/live/run.h"

#include <malloc.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

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
#include "config/model/network.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/log.h"
#include "gateway/base/version.h"
#include "gateway/base/whole_file.h"
#include "gateway/base/worker.h"
#include "gateway/daemon/daemon.h"
#include "gateway/daemon/reload/trial.h"
#include "gateway/outputs/dds/discovery/announcement_relay.h"
#include "gateway/outputs/dds/link/child_process.h"
#include "gateway/records/disk/state_folder.h"
#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/terminal/command_end.h"

namespace baudgate::tools {
namespace {

constexpr auto kLookEvery = 1000ms;
/// The daemon must stop within this time, which is shorter than TimeoutStopSec of the service.
constexpr auto kStopWithin = 4s;

/// Returns the interval of reports to systemd: a tenth of WatchdogSec, at most 1 s, so that systemd
/// acts only when at least nine reports in a row are missing.
timespec LookInterval(std::uint64_t watchdog_us) {
  auto interval = std::chrono::microseconds(kLookEvery);
  if (watchdog_us > 0) interval = std::min(interval, std::chrono::microseconds(watchdog_us) / 10);
  return {interval / 1s, std::chrono::nanoseconds(interval % 1s).count()};
}

/// Reports to systemd's watchdog until SIGTERM or SIGINT arrives; SIGHUP requests a reload. Makes
/// no report while this thread or an event loop of the whole gateway hangs. The thread of one line
/// does not count.
void WaitForStop(const sigset_t& signals, daemon::Daemon& daemon) {
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

/// A reload refuses a pipe, because it would wait for the pipe's writer. A start accepts one.
Result<std::string> ReadAgain(const std::string& file) {
  std::error_code gone;
  const auto kind = std::filesystem::status(file, gone).type();
  const bool other = !gone && kind != std::filesystem::file_type::regular;
  if (other)
    return Error{"is not a regular file, so a reload does not read it; restart the gateway"};
  return ReadText(file);
}

std::vector<std::string> ProblemsOf(const config::Loaded& loaded) {
  std::vector<std::string> all;
  for (const config::Problem& problem : loaded.problems) all.push_back(ToString(problem));
  return all;
}

/// The configuration to start with: the file, or the last confirmed configuration if the file was
/// rolled back.
struct Choice {
  config::Loaded loaded;
  daemon::ReloadOptions reload;
};

daemon::ReloadOptions ReloadOf(const std::string& file, const config::Catalog& catalog) {
  daemon::ReloadOptions reload;
  reload.file = file;
  reload.read = [file] { return ReadAgain(file); };
  reload.load = [file, &catalog](const std::string& text) {
    config::Loaded loaded = config::LoadText(text, file, catalog);
    std::vector<std::string> problems = ProblemsOf(loaded);
    if (!loaded.ok()) return daemon::LoadedText{{}, std::move(problems)};
    return daemon::LoadedText{std::move(loaded.config), std::move(problems)};
  };
  reload.masked = [&catalog](const std::string& running) {
    return config::MaskedConfig(running, config::SecretKeys(catalog));
  };
  reload.notify = [](const std::string& state) { sd_notify(0, state.c_str()); };
  return reload;
}

Choice Choose(const std::string& file, const config::Catalog& catalog, std::ostream& err) {
  Choice choice{.loaded = {}, .reload = ReloadOf(file, catalog)};
  daemon::ReloadOptions& reload = choice.reload;
  const auto text = ReadText(file, Kind::any);
  choice.loaded = text ? config::LoadText(*text, file, catalog) : config::LoadFile(file, catalog);
  PrintProblems(choice.loaded.problems, err);
  if (!text || !choice.loaded.ok()) return choice;
  reload.text_at_start = *text;
  const config::Config& config = choice.loaded.config;
  const auto folder = StateFolderOf(records::StatePlaces::Here(config.state), config.name);
  if (folder.empty()) return choice;
  reload.kept.emplace(folder / reload::KeptConfigs::kFolder);
  if (!reload.kept->IsUnconfirmed(*text)) {
    if (reload.kept->trial() == reload::KeptConfigs::Trial::running) {
      err << "baudgate: the gateway ended while a configuration was on trial. " << file
          << " has been edited since, so the gateway runs it without a trial\n";
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
    err << "baudgate: the confirmed configuration " << copy << " cannot run; correct " << file
        << ", and start the gateway again\n";
  }
  return choice;
}

class StopGuard {
 public:
  StopGuard()
      : worker_("stop guard", [until = ReadClocks().instant + kStopWithin](bool stopped) {
          if (stopped || ReadClocks().instant < until) return until;
          log::Fail(
              "the stop takes longer than {} s, because a file, a disk or a driver does not "
              "answer. The gateway ends without waiting",
              kStopWithin / 1s);
          log::Flush();
          std::_Exit(kExitCanNot);
        }) {
    worker_.Start();
  }

 private:
  Worker worker_;
};

/// Must be called before any thread starts, so that all threads inherit the blocked signals.
sigset_t BlockSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // If SIGXFSZ is ignored, a write beyond the file size limit fails like a write to a full disk.
  for (const int ignored : {SIGPIPE, SIGUSR1, SIGUSR2, SIGXFSZ}) signal(ignored, SIG_IGN);
  return signals;
}

}  // namespace

int Serve(config::Config config, std::optional<daemon::ReloadOptions> reload,
          const config::Catalog& catalog) try {
  const sigset_t signals = BlockSignals();
  // The guard is declared before the daemon, so that it is still alive in the daemon's destructor.
  std::optional<StopGuard> stop_guard;
  daemon::Daemon daemon(std::move(config), catalog);
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
  // If Stop fails, a driver is blocked. Destructors would wait for the driver, so they are skipped.
  if (!daemon.Stop()) {
    log::Flush();
    std::_Exit(0);
  }
  return kExitDone;
} catch (const std::system_error& failed) {
  log::Plain(
      "baudgate: the system has no free file descriptor or thread: " + failed.code().message() +
      "; raise LimitNOFILE and TasksMax of the service (ulimit -n, ulimit -u)\n");
  return kExitCanNot;
}

int RunDaemon(const std::string& file, const config::Catalog& catalog) {
  // Reading a pipe can block until its writer comes. SIGTERM and SIGINT still end the process in
  // this time. SIGHUP is blocked, because there is nothing to reload yet.
  sigset_t later;
  sigemptyset(&later);
  sigaddset(&later, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &later, nullptr);
  std::ostringstream problems;
  Choice choice = Choose(file, catalog, problems);
  log::Plain(problems.str());
  if (!choice.loaded.ok()) return kExitBadConfiguration;
  // The parser of a large file leaves hundreds of megabytes of free memory, which are returned to
  // the system here.
  ::malloc_trim(0);
  return Serve(std::move(choice.loaded.config), std::move(choice.reload), catalog);
}

namespace {

constexpr int kSignOfLife = 1000;  // longest time between two reports, in ms

void TellSystemd(std::size_t participants) {
  sd_notifyf(0, "WATCHDOG=1\nSTATUS=%zu DDS participants found", participants);
}

}  // namespace

int RunDiscoveryServer(const std::string& listen, std::ostream& err) {
  const auto at = config::ParseDiscoveryServer(listen);
  if (!at) {
    err << "discovery-server: --listen: " << at.error() << '\n';
    return kExitUsage;
  }
  const StopSignals stop;
  auto socket = dds::RelaySocket::Open(*at);
  if (!socket) {
    err << "discovery-server: " << socket.error() << '\n';
    return kExitCanNot;
  }
  log::Info("discovery server: waits for DDS participants at {}:{}", at->host, at->port);
  sd_notify(0, "READY=1");
  dds::AnnouncementRelay relay;
  Instant next_sign{};
  pollfd waited[] = {{stop.descriptor(), POLLIN, 0}, {socket->descriptor(), POLLIN, 0}};
  while ((waited[0].revents & POLLIN) == 0) {
    ::poll(waited, 2, kSignOfLife);
    socket->Take(relay);
    const Instant now = ReadClocks().instant;
    if (now < next_sign) continue;
    next_sign = now + 1s;
    TellSystemd(relay.participants());
  }
  sd_notify(0, "STOPPING=1");
  return kExitDone;
}

namespace {

std::string PointsOfProfiles(const config::Catalog& catalog) {
  std::string text;
  for (const config::ProfileFile& file : catalog.Profiles()) {
    const protocols::Protocol* protocol = catalog.FindProtocol(file.protocol);
    if (protocol == nullptr) continue;
    const auto loaded = config::LoadProfile(file.path.string(), *protocol, catalog);
    for (const config::Point& point : loaded.profile.points) {
      text += (point.access == config::Access::write ? "-" : "") + point.name + " ";
    }
    text += "\n";
  }
  return text;
}

/// Writes `text` into a memory file, which the program that is started inherits. Returns the path
/// of the file; empty: the file cannot be created, so `watch` sorts points by name.
std::string FileOf(const std::string& text) {
  const int file = ::memfd_create("point-order", 0);
  if (file < 0 || ::write(file, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    return {};
  }
  return "/proc/self/fd/" + std::to_string(file);
}

}  // namespace

int RunWatch(const std::vector<std::string>& words, const config::Catalog& catalog,
             std::ostream& err) {
  const auto program = dds::FindProgram("baudgate-dds");
  if (!program) {
    err << "watch: " << program.error() << "; install the package baudgate-dds\n";
    return kExitCanNot;
  }
  // argv[0] and argv[1] of baudgate-dds: it begins its messages with the name in argv[0].
  std::vector<std::string> all{"baudgate", "watch"};
  all.insert(all.end(), words.begin(), words.end());
  if (const std::string order = FileOf(PointsOfProfiles(catalog)); !order.empty()) {
    all.insert(all.end(), {"--point-order", order});
  }
  std::vector<char*> pointers;
  for (std::string& word : all) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(program->c_str(), pointers.data());
  err << "watch: " << *program << ": " << std::strerror(errno) << "\n";
  return kExitCanNot;
}

}  // namespace baudgate::tools
