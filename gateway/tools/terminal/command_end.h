// SIGINT, SIGTERM and SIGHUP as a descriptor, for commands that run until they are stopped, or
// until their terminal is gone; for those that draw on a terminal also that its size has changed.
// AfterOutput tells whether what was printed has arrived.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

#include "gateway/base/time.h"

namespace baudgate::tools {

/// Blocks the signals while it lives; one that came meanwhile has done its work and is forgotten.
class StopSignals {
 public:
  enum class And : std::uint8_t { nothing, resize };
  explicit StopSignals(And also = And::nothing) {
    sigemptyset(&set_);
    sigaddset(&set_, SIGINT);
    sigaddset(&set_, SIGTERM);
    if (!IsIgnored(SIGHUP)) sigaddset(&set_, SIGHUP);  // behind nohup it is
    if (also == And::resize) sigaddset(&set_, SIGWINCH);
    pthread_sigmask(SIG_BLOCK, &set_, &before_);
    descriptor_ = ::signalfd(-1, &set_, SFD_CLOEXEC | SFD_NONBLOCK);
  }
  ~StopSignals() {
    signalfd_siginfo info{};
    while (::read(descriptor_, &info, sizeof info) > 0) {
    }
    ::close(descriptor_);
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  /// Has something to read once a signal has come.
  int descriptor() const { return descriptor_; }
  /// Whether any signal comes within this time.
  bool Wait(Duration time) const {
    pollfd waited{descriptor_, POLLIN, 0};
    const auto whole = std::chrono::ceil<std::chrono::milliseconds>(time).count();
    return ::poll(&waited, 1, static_cast<int>(std::clamp<std::int64_t>(whole, 0, 1'000'000))) == 1;
  }
  /// Whether one to stop has come since the last question.
  bool Came() const {
    bool stop = false;
    signalfd_siginfo info{};
    while (::read(descriptor_, &info, sizeof info) > 0) stop |= info.ssi_signo != SIGWINCH;
    return stop;
  }

 private:
  static bool IsIgnored(int signal) {
    struct sigaction held {};
    return ::sigaction(signal, nullptr, &held) == 0 && held.sa_handler == SIG_IGN;
  }

  sigset_t set_{};
  sigset_t before_{};
  int descriptor_ = -1;
};

// Whether what was printed has arrived: the last thing a command does.

/// The exit code behind output of which `code` was the result. What a full disk has swallowed must
/// not look like success (4); a reader that has left has seen what it wanted.
int AfterOutput(int code);

}  // namespace baudgate::tools
