// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/unit_table.h"

#include <algorithm>
#include <map>

#include "config/model/units.h"
#include "gateway/tools/terminal/text_table.h"

namespace baudgate {
namespace {

using config::Listener;
using config::Route;
using config::UnitSet;
using config::UnitsText;
using Rows = std::vector<UnitRow>;

std::string Numbered(const std::string& word, const UnitSet& units) {
  return word + (units.count() == 1 ? " " : "s ") + UnitsText(units);
}

void AddDevices(const config::Config& config, Rows& rows) {
  std::map<std::uint8_t, UnitRow> by_unit;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (!device.unit) continue;
      by_unit[*device.unit] = {std::to_string(*device.unit),
                               "device " + device.name + " on line " + line.name +
                                   (device.enabled ? " (cached)" : " (cached, disabled)"),
                               ""};
    }
  }
  for (const auto& [unit, row] : by_unit) rows.push_back(row);
}

template <typename Predicate>
std::vector<std::string> PlacesOf(const config::Modbus& modbus, Predicate predicate) {
  std::vector<std::string> places;
  for (const Listener& listener : modbus.listen) {
    if (predicate(listener)) places.push_back(listener.Place());
  }
  return places;
}

/// Writes to unit 0 that no route names.
std::vector<std::string> Passing(const config::Modbus& modbus) {
  return PlacesOf(modbus, [](const Listener& listener) {
    return listener.broadcast == Listener::Broadcast::pass;
  });
}

/// Writes to unit 0 go to all slaves; reads of it stay the gateway's.
bool IsBroadcast(const Route& route) {
  return route.first == 0 && !route.remap && !route.line.empty();
}

void AddRoute(const config::Modbus& modbus, const Route& route, UnitSet units, Rows& rows) {
  const std::string deadline = FormatDuration(route.deadline);
  if (units[0] && IsBroadcast(route)) {
    const bool passed = !Passing(modbus).empty();
    rows.push_back({"0 (writes)",
                    route.Target() + ", all slaves, never answered" +
                        (passed ? "" : "; but no listener has broadcast: pass"),
                    deadline});
    units.reset(0);
  }
  if (units.none()) return;
  UnitSet there;
  for (std::size_t unit = 0; unit < units.size(); ++unit) {
    if (units[unit]) there.set(route.SlaveOf(static_cast<std::uint8_t>(unit)));
  }
  const std::string word = route.line.empty() ? "unit" : "slave";
  rows.push_back({UnitsText(units), route.Target() + ", " + Numbered(word, there), deadline});
}

template <typename Texts>
std::string Joined(const Texts& texts) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : ", ") + text;
  return joined;
}

std::vector<std::string> RoutedLines(const config::Config& config) {
  std::vector<std::string> names;
  for (const Route& route : config.modbus.routes) {
    const bool is_new = std::find(names.begin(), names.end(), route.line) == names.end();
    if (!route.line.empty() && is_new) names.push_back(route.line);
  }
  return names;
}

void AddBroadcasts(const config::Config& config, Rows& rows) {
  const auto lines = RoutedLines(config);
  const auto places = Passing(config.modbus);
  if (lines.empty() || places.empty()) return;
  std::string target = "all slaves of line" + std::string(lines.size() == 1 ? " " : "s ") +
                       Joined(lines) + ", never answered";
  if (places.size() < config.modbus.listen.size()) target += " (from " + Joined(places) + ")";
  rows.push_back({"0 (writes)", std::move(target), ""});
}

std::string OthersGet(const config::Modbus& modbus) {
  const auto silent = PlacesOf(
      modbus, [](const Listener& listener) { return listener.errors == Listener::Errors::silent; });
  if (silent.empty()) return "nothing: exception 0x0A";
  if (silent.size() == modbus.listen.size()) return "nothing: no answer";
  return "nothing: exception 0x0A; no answer at " + Joined(silent);
}

}  // namespace

std::vector<UnitRow> UnitRows(const config::Config& config) {
  Rows rows;
  AddDevices(config, rows);
  const auto reached = config::RouteUnits(config);
  UnitSet own = UnitSet().set(0).set(255);
  bool zero_routed = false;
  for (std::size_t i = 0; i < reached.size(); ++i) {
    const Route& route = config.modbus.routes[i];
    AddRoute(config.modbus, route, reached[i], rows);
    zero_routed = zero_routed || reached[i][0];
    UnitSet taken = reached[i];
    if (IsBroadcast(route)) taken.reset(0);
    own &= ~taken;
  }
  if (!zero_routed) AddBroadcasts(config, rows);
  if (own.any()) {
    rows.push_back({UnitsText(own), "the gateway itself: its status from register 9000", ""});
  }
  rows.push_back({"others", OthersGet(config.modbus), ""});
  return rows;
}

void PrintRouteTable(const config::Config& config, std::ostream& out) {
  out << "\nModbus units, in the order of matching\n";
  config::TextTable table({"unit", "goes to", "deadline"});
  for (const UnitRow& row : UnitRows(config)) table.Add({row.units, row.target, row.deadline});
  table.PrintAligned(out, "  ");
}

}  // namespace baudgate
