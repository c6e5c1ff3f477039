// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/host_clock.h"

#include <pthread.h>
#include <sys/timex.h>

#include <cerrno>
#include <optional>
#include <utility>

#include "gateway/daemon/time_service.h"

namespace baudgate {
namespace {

constexpr Duration kInterval = 5s;
constexpr Duration kServiceInterval = 1min;  // each question starts a process, which then lingers

/// Nothing: it may not be asked.
std::optional<bool> AskKernel() {
  timex state{};
  const int found = ntp_adjtime(&state);
  if (found < 0 && errno == EPERM) return std::nullopt;
  return found >= 0 && found != TIME_ERROR && (state.status & STA_UNSYNC) == 0;
}

}  // namespace

HostClock::HostClock(std::function<void(bool)> tell)
    : tell_(std::move(tell)), thread_([this] { Run(); }) {}

HostClock::~HostClock() {
  RequestStop();
  thread_.join();
}

void HostClock::RequestStop() {
  {
    const MutexLock lock(mutex_);
    stop_ = true;
  }
  ends_.notify_one();
}

void HostClock::Run() {
  pthread_setname_np(pthread_self(), "clock");
  bool told = false;
  for (bool goes_on = true; goes_on;) {
    const auto kernel = AskKernel();
    const bool right = kernel ? *kernel : AskTimeService().value_or(false);
    if (std::exchange(told, right) != right) tell_(right);
    goes_on = Sleep(kernel ? kInterval : kServiceInterval);
  }
}

bool HostClock::Sleep(Duration time) {
  MutexLock lock(mutex_);
  const Instant end = ReadClocks().instant + time;
  while (!stop_ && lock.WaitUntil(ends_, end)) {
  }
  return !stop_;
}

}  // namespace baudgate
