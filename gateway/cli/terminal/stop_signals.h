// SIGINT and SIGTERM as a descriptor, for commands that run until they are stopped.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

namespace baudgate {

/// Blocks both signals while it lives; one that came meanwhile has done its work and is forgotten.
class StopSignals {
 public:
  StopSignals() {
    sigemptyset(&set_);
    sigaddset(&set_, SIGINT);
    sigaddset(&set_, SIGTERM);
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
  /// Whether one has come since the last question.
  bool Came() const {
    signalfd_siginfo info{};
    return ::read(descriptor_, &info, sizeof info) > 0;
  }

 private:
  sigset_t set_{};
  sigset_t before_{};
  int descriptor_ = -1;
};

}  // namespace baudgate
