// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/trouble.h"

#include <algorithm>
#include <array>

#include "gateway/base/text.h"

namespace baudgate::events {
namespace {

constexpr std::array<std::string_view, kTroubles> kNames = {
    "no answer",          "wrong device",        "another device",
    "port down",          "ring open",           "no answer to clients",
    "server away",        "events are not kept", "writes are not recorded",
    "values are not kept"};
constexpr std::string_view kUnit = "unit-";

/// The first that names the unit; null: none does.
const config::Route* RouteOf(const config::Config& config, std::string_view device) {
  if (!device.starts_with(kUnit)) return nullptr;
  const auto unit = ParseInteger<std::uint8_t>(device.substr(kUnit.size()));
  if (!unit) return nullptr;
  const auto& routes = config.modbus.routes;
  const auto route =
      std::ranges::find_if(routes, [&](const config::Route& one) { return one.Covers(*unit); });
  return route == routes.end() ? nullptr : &*route;
}

std::optional<config::AlarmSetting> OfRoute(const config::Config& config, std::string_view line,
                                            std::string_view device) {
  const config::Route* const route = RouteOf(config, device);
  if (route == nullptr || route->line != line) return std::nullopt;
  return route->alarms;
}

std::optional<config::AlarmSetting> OfServer(const config::Config& config,
                                             std::string_view server) {
  for (const config::Route& route : config.modbus.routes) {
    if (!route.line.empty() || HostAndPort(route.host, route.port) != server) continue;
    return route.alarms;
  }
  return std::nullopt;
}

}  // namespace

std::string_view Name(Trouble trouble) { return kNames[static_cast<std::size_t>(trouble)]; }

std::optional<Trouble> TroubleNamed(std::string_view name) {
  const auto found = std::ranges::find(kNames, name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<Trouble>(found - kNames.begin());
}

std::string UnitName(std::uint8_t unit) { return std::string(kUnit) + std::to_string(unit); }

std::string ServerOf(const config::Config& config, std::string_view unit) {
  const config::Route* const route = RouteOf(config, unit);
  if (route == nullptr || !route->line.empty()) return {};
  return HostAndPort(route->host, route->port);
}

std::optional<config::AlarmSetting> SettingOf(const config::Config& config, Trouble trouble,
                                              std::string_view line, std::string_view device) {
  if (trouble >= Trouble::events_lost) return config.alarms;
  if (trouble == Trouble::unit_silent) return OfRoute(config, line, device);
  if (trouble == Trouble::server_away) return OfServer(config, device);
  const auto its_line = std::ranges::find(config.lines, line, &config::Line::name);
  if (line.empty() || its_line == config.lines.end()) return std::nullopt;
  if (trouble >= Trouble::port_down) return its_line->alarms;
  const auto its = std::ranges::find(its_line->devices, device, &config::Device::name);
  if (its == its_line->devices.end()) return std::nullopt;
  return its->alarms;
}

}  // namespace baudgate::events
