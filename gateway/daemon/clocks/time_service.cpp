// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/clocks/time_service.h"

#include <systemd/sd-bus.h>

#include <chrono>
#include <memory>

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

}  // namespace baudgate
