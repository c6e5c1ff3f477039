// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/live/run.h"

#include <signal.h>
#include <systemd/sd-daemon.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "config/loader.h"
#include "gateway/base/log.h"
#include "gateway/base/version.h"
#include "gateway/cli/offline/check.h"
#include "gateway/daemon/daemon.h"

namespace baudgate {

namespace {

constexpr auto kLookEvery = 1000ms;

/// A tenth of WatchdogSec, a second at most; systemd gets nine tries to be late.
timespec LookInterval(std::uint64_t watchdog_us) {
  auto interval = std::chrono::microseconds(kLookEvery);
  if (watchdog_us > 0) interval = std::min(interval, std::chrono::microseconds(watchdog_us) / 10);
  return {interval / 1s, std::chrono::nanoseconds(interval % 1s).count()};
}

/// The sign of life is this thread's: a thread that hangs, this one too, keeps it back. A terminal
/// that closes and whoever rotates logs send SIGHUP: neither wants the lines to stop.
void WaitForStop(const sigset_t& signals, Daemon& daemon) {
  std::uint64_t watchdog_us = 0;
  const bool watched = sd_watchdog_enabled(0, &watchdog_us) > 0;
  const timespec interval = LookInterval(watched ? watchdog_us : 0);
  for (;;) {
    const int caught = sigtimedwait(&signals, nullptr, &interval);
    if (caught == SIGTERM || caught == SIGINT) return;
    if (caught == SIGHUP) {
      log::Info("SIGHUP is ignored: nothing is reloaded; restart to read the configuration anew");
    }
    if (daemon.Look() && watched) sd_notify(0, "WATCHDOG=1");
  }
}

}  // namespace

int RunDaemon(const std::string& file, const config::Catalog& catalog, std::ostream& err) {
  const config::Loaded loaded = config::LoadFile(file, catalog);
  PrintProblems(loaded.problems, err);
  if (!loaded.ok()) return 3;

  // Blocked before any thread starts, so that all of them inherit it and only this one takes them.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // SIGXFSZ: a write beyond a limit of file sizes fails, as on a full disk.
  for (const int ignored : {SIGPIPE, SIGUSR1, SIGUSR2, SIGXFSZ}) signal(ignored, SIG_IGN);

  Daemon daemon(loaded.config, catalog);
  if (const Status status = daemon.Start(); !status) {
    err << "baudgate: " << status.error() << "\n";
    return 4;
  }
  log::Info("baudgate {} runs: {}", kVersion, daemon.Summary());
  sd_notifyf(0, "READY=1\nSTATUS=%s", daemon.Summary().c_str());

  WaitForStop(signals, daemon);
  sd_notify(0, "STOPPING=1");
  log::Info("baudgate stops");
  // Without destructors: they would wait for the driver.
  if (!daemon.Stop()) std::_Exit(0);
  return 0;
}

}  // namespace baudgate
