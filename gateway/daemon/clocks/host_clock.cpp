// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/clocks/host_clock.h"

#include <sys/timex.h>
#include <systemd/sd-bus.h>

#include <cerrno>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

namespace baudgate {

namespace {

constexpr std::chrono::microseconds kWaitForReply = std::chrono::seconds(2);

}  // namespace

std::optional<bool> AskTimeService() {
  sd_bus* opened = nullptr;
  if (sd_bus_open_system(&opened) < 0) return std::nullopt;
  const std::unique_ptr<sd_bus, decltype(&sd_bus_flush_close_unref)> bus(opened,
                                                                         sd_bus_flush_close_unref);
  return AskTimeService(*bus);
}

std::optional<bool> AskTimeService(sd_bus& bus) {
  sd_bus_set_method_call_timeout(&bus, static_cast<std::uint64_t>(kWaitForReply.count()));
  int synchronised = 0;
  if (sd_bus_get_property_trivial(&bus, "org.freedesktop.timedate1", "/org/freedesktop/timedate1",
                                  "org.freedesktop.timedate1", "NTPSynchronized", nullptr, 'b',
                                  &synchronised) < 0) {
    return std::nullopt;
  }
  return synchronised != 0;
}

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
