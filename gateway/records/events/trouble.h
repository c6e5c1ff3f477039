// What is wrong with the gateway's own lines, devices, routes and disks, as far as it is an alarm:
// how that alarm is called, and what the configuration says of it. docs/events.md has the names for
// users.
//
//   trouble       line    device          setting
//   no_answer     bay-1   feeder-1        of the device
//   port_down     bay-1                   of the line
//   unit_silent   drive   unit-51         of the route that leads the unit 51 to line drive
//   unit_silent           unit-70         of the route to a server elsewhere
//   server_away           10.0.0.9:502    likewise
//   events_lost                           of the gateway
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "config/model/config.h"

namespace baudgate::events {

enum class Trouble : std::uint8_t {
  no_answer,     ///< of a device
  wrong_device,  ///< it is not what it should be
  replaced,      ///< another one answers in its place; without an end
  port_down,     ///< of a line
  ring_open,
  unit_silent,  ///< behind a route, as its clients see it
  server_away,  ///< to which a route leads
  events_lost,  ///< of the gateway: events cannot be kept
  writes_lost,  ///< writes cannot be recorded
  values_lost,  ///< values cannot be kept
};
inline constexpr std::size_t kTroubles = 10;

/// "no answer": the name of the alarm, and how its text begins.
std::string_view Name(Trouble trouble);
/// Empty: it is the name of another alarm.
std::optional<Trouble> TroubleNamed(std::string_view name);

/// "unit-51": the device of an alarm of a routed unit, by the number that clients ask for.
std::string UnitName(std::uint8_t unit);

/// "10.0.0.9:502": the server to which this unit is routed; empty: to none.
std::string ServerOf(const config::Config& config, std::string_view unit);

/// The setting that counts; empty: the configuration has no such line, device or route.
std::optional<config::AlarmSetting> SettingOf(const config::Config& config, Trouble trouble,
                                              std::string_view line, std::string_view device);

}  // namespace baudgate::events
