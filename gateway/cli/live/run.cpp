// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/live/run.h"

#include <signal.h>
#include <systemd/sd-daemon.h>

#include "config/loader.h"
#include "gateway/base/log.h"
#include "gateway/base/version.h"
#include "gateway/cli/offline/check.h"
#include "gateway/daemon/daemon.h"

namespace baudgate {

namespace {

/// A terminal that closes and whoever rotates logs send SIGHUP: neither wants the lines to stop.
void WaitForStop(const sigset_t& signals) {
  for (;;) {
    int caught = 0;
    sigwait(&signals, &caught);
    if (caught != SIGHUP) return;
    log::Info("SIGHUP is ignored: nothing is reloaded; restart to read the configuration anew");
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
  for (const int ignored : {SIGPIPE, SIGUSR1, SIGUSR2}) signal(ignored, SIG_IGN);

  Daemon daemon(loaded.config, catalog);
  if (const Status status = daemon.Start(); !status) {
    err << "baudgate: " << status.error() << "\n";
    return 4;
  }
  log::Info("baudgate {} runs: {}", kVersion, daemon.Summary());
  sd_notifyf(0, "READY=1\nSTATUS=%s", daemon.Summary().c_str());

  WaitForStop(signals);
  sd_notify(0, "STOPPING=1");
  log::Info("baudgate stops");
  daemon.Stop();
  return 0;
}

}  // namespace baudgate
