// SPDX-License-Identifier: Apache-2.0
#include "config/model/config.h"

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

std::string RangeText(std::size_t first, std::size_t last) {
  if (first == last) return std::to_string(first);
  return std::to_string(first) + "-" + std::to_string(last);
}

}  // namespace

Result<std::pair<std::uint8_t, std::uint8_t>> ParseUnits(std::string_view text) {
  if (const Status status = RefuseLeadingZeros(text, "^- "); !status) return Error{status.error()};
  const auto parts = Split(text, '-');
  const auto first = ParseInteger<int>(Trim(parts.front()));
  const auto last = ParseInteger<int>(Trim(parts.back()));
  if (parts.size() > 2 || !first || !last) {
    return Error{
        Quoted(text) +
        " is neither a unit id nor a range of unit ids; write for example 20 or \"33-40\""};
  }
  if (*first < 0 || *first > 255 || *last < 0 || *last > 255) {
    return Error{Quoted(text) + " is out of range; allowed: 0…255"};
  }
  if (*first > *last) {
    return Error{Quoted(text) + " begins with its higher end; write \"" + std::to_string(*last) +
                 "-" + std::to_string(*first) + "\""};
  }
  return std::pair(static_cast<std::uint8_t>(*first), static_cast<std::uint8_t>(*last));
}

std::vector<TlsUse> TlsUses(const Config& config) {
  std::vector<TlsUse> uses;
  const auto add = [&uses](const char* kind, const std::string& where, const TlsFiles& files,
                           const Mark& mark) {
    if (files.on()) uses.push_back({where, files, mark, kind});
  };
  if (config.web.on) add("web", "web", config.web.tls, config.web.certificate_mark);
  if (config.mqtt.on) add("mqtt", "mqtt", config.mqtt.tls, config.mqtt.mark);
  if (config.modbus.enabled) {
    for (const Listener& listener : config.modbus.listen) {
      add("modbus", "listener " + listener.Address(), listener.tls, listener.mark);
    }
    for (const Route& route : config.modbus.routes) {
      add("modbus", "route for " + route.Units(), route.tls, route.mark);
    }
  }
  for (const Line& line : config.lines) {
    add("ports", "line " + line.name, line.tls, line.mark);
    if (const PortServer* server = line.server()) {
      add("ports", "the port of line " + line.name, server->tls, server->mark);
    }
  }
  return uses;
}

std::string UnitsText(const UnitSet& units) {
  std::string text;
  for (std::size_t unit = 0; unit < units.size(); ++unit) {
    if (!units[unit]) continue;
    const std::size_t first = unit;
    while (unit + 1 < units.size() && units[unit + 1]) ++unit;
    text += (text.empty() ? "" : ", ") + RangeText(first, unit);
  }
  return text;
}

UnitSet UnitsOf(const Route& route) {
  UnitSet units;
  for (std::size_t unit = route.first; unit <= route.last; ++unit) units.set(unit);
  return units;
}

UnitSet DeviceUnits(const Config& config) {
  UnitSet units;
  for (const Line& line : config.lines) {
    for (const Device& device : line.devices) {
      if (device.unit) units.set(*device.unit);
    }
  }
  return units;
}

std::vector<UnitSet> RouteUnits(const Config& config) {
  std::vector<UnitSet> reached;
  UnitSet taken = DeviceUnits(config);
  for (const Route& route : config.modbus.routes) {
    reached.push_back(UnitsOf(route) & ~taken);
    taken |= reached.back();
  }
  return reached;
}

}  // namespace baudgate::config
