// `StopSignals` delivers SIGINT, SIGTERM and SIGHUP by a descriptor, for commands that run until
// they are stopped or their terminal is closed. Commands that draw on a terminal can also get
// SIGWINCH, which reports a new size.
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

/// Blocks the signals during its lifetime. Signals that were not read are discarded by the
/// destructor.
class StopSignals {
 public:
  enum class And : std::uint8_t { nothing, resize };
  explicit StopSignals(And also = And::nothing) {
    sigemptyset(&set_);
    sigaddset(&set_, SIGINT);
    sigaddset(&set_, SIGTERM);
    if (!IsIgnored(SIGHUP)) sigaddset(&set_, SIGHUP);  // nohup makes a command ignore SIGHUP
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
  /// The descriptor is readable when a signal has come.
  int descriptor() const { return descriptor_; }
  /// Waits for a signal, at most `time` or 1000 s. Returns true if a signal has come.
  bool Wait(Duration time) const {
    pollfd waited{descriptor_, POLLIN, 0};
    const auto whole = std::chrono::ceil<std::chrono::milliseconds>(time).count();
    return ::poll(&waited, 1, static_cast<int>(std::clamp<std::int64_t>(whole, 0, 1'000'000))) == 1;
  }
  /// True if a signal to stop has come since the last call. SIGWINCH is not a signal to stop.
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

/// Returns the exit code of a command. If the output cannot be written, for example to a full disk,
/// returns 4 in place of a successful `code`. If the program that reads the output has closed it,
/// this is not an error.
int AfterOutput(int code);

}  // namespace baudgate::tools
