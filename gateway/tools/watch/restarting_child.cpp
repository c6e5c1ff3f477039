// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/restarting_child.h"

#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "gateway/base/exit_code.h"

namespace baudgate::tools {
namespace {

constexpr int kEndedBySignal = 128;

/// `PassedSignals` blocks the signals that are passed to the child, and delivers them by a
/// descriptor. The child restores the former signal mask.
class PassedSignals {
 public:
  PassedSignals() {
    sigemptyset(&set_);
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGCHLD}) sigaddset(&set_, number);
    sigprocmask(SIG_BLOCK, &set_, &before_);
    descriptor_ = ::signalfd(-1, &set_, SFD_CLOEXEC | SFD_NONBLOCK);
  }
  ~PassedSignals() {
    ::close(descriptor_);
    Restore();
  }
  PassedSignals(const PassedSignals&) = delete;
  PassedSignals& operator=(const PassedSignals&) = delete;

  void Restore() const { sigprocmask(SIG_SETMASK, &before_, nullptr); }
  struct Signal {
    int number = 0;
    bool from_key = false;  ///< true: by Ctrl-C, so the child has received the signal as well
  };
  /// Returns the next signal; number 0: no signal came in time.
  Signal Next(int milliseconds) const {
    pollfd waited{descriptor_, POLLIN, 0};
    ::poll(&waited, 1, milliseconds);
    signalfd_siginfo info{};
    if (::read(descriptor_, &info, sizeof info) <= 0) return {};
    return {static_cast<int>(info.ssi_signo), info.ssi_code == SI_KERNEL};
  }

 private:
  sigset_t set_{};
  sigset_t before_{};
  int descriptor_ = -1;
};

pid_t StartChild(const std::function<int()>& run, const PassedSignals& signals) {
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kExitCanNot);
  signals.Restore();
  ::_exit(run());
}

/// Passes signals to the child until the child ends. Sets `stopped` if a signal to stop came.
/// Returns the wait status of the child.
int WaitFor(pid_t child, const PassedSignals& signals, bool& stopped) {
  int status = 0;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    const auto [number, from_key] = signals.Next(-1);
    if (number == 0 || number == SIGCHLD) continue;
    stopped = true;
    if (!from_key) ::kill(child, number);
  }
  return status;
}

/// Waits for `time`. Returns false at once if a signal to stop comes.
bool Sleep(Duration time, const PassedSignals& signals) {
  const int number = signals.Next(static_cast<int>(time / 1ms)).number;
  return number == 0 || number == SIGCHLD;
}

}  // namespace

int RunGuarded(const std::function<int()>& run, std::span<const Duration> ladder,
               std::ostream& err) {
  const PassedSignals signals;
  for (std::size_t rung = 0;; ++rung) {
    bool stopped = false;
    const pid_t child = StartChild(run, signals);
    if (child < 0) {
      err << "watch: " << std::strerror(errno) << '\n';
      return kExitCanNot;
    }
    const int status = WaitFor(child, signals, stopped);
    if (WIFEXITED(status)) return WEXITSTATUS(status);
    const int number = WTERMSIG(status);
    if (stopped || number == SIGPIPE) return kEndedBySignal + number;
    err << "watch: the process with the DDS library was ended by signal " << number
        << "; watch restarts" << std::endl;
    if (!Sleep(ladder[std::min(rung, ladder.size() - 1)], signals)) return 0;
  }
}

}  // namespace baudgate::tools
