// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/clocks/host_clock.h"

#include <sys/timex.h>

#include <cerrno>
#include <optional>
#include <utility>

#include "gateway/daemon/clocks/time_service.h"

namespace baudgate {
namespace {

constexpr Duration kInterval = 5s;
constexpr Duration kServiceInterval = 1min;  // each question starts a process, which then lingers

/// Empty: it may not be asked.
std::optional<bool> AskKernel() {
  timex state{};
  const int found = ntp_adjtime(&state);
  if (found < 0 && errno == EPERM) return std::nullopt;
  return found >= 0 && found != TIME_ERROR && (state.status & STA_UNSYNC) == 0;
}

}  // namespace

HostClock::HostClock(std::function<void(bool)> tell)
    : tell_(std::move(tell)), worker_("clock", [this](bool last) {
        return last ? kWhenWoken : ReadClocks().instant + Look();
      }) {
  worker_.Start();
}

Duration HostClock::Look() {
  const auto kernel = AskKernel();
  const bool right = kernel ? *kernel : AskTimeService().value_or(false);
  if (std::exchange(told_, right) != right) tell_(right);
  return kernel ? kInterval : kServiceInterval;
}

}  // namespace baudgate
