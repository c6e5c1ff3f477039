// Words that the parts of `baudgate check` share. PrintEvents, PrintWrites, PrintWeb,
// PrintRouteTable and PrintListener print one part each.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "config/model/line.h"
#include "config/model/network.h"
#include "config/model/outputs.h"
#include "config/model/problem.h"

namespace baudgate::tools {

template <typename Range, typename Text>
std::string Joined(const Range& range, Text text) {
  std::string joined;
  for (const auto& one : range) {
    if (!joined.empty()) joined += ", ";
    joined += text(one);
  }
  return joined;
}

/// "everybody who reaches it", "10.0.0.7, 10.1.0.0/16".
inline std::string Whom(const std::vector<config::Network>& allow) {
  if (allow.empty()) return "everybody who reaches it";
  return Joined(allow, [](const auto& network) { return network.text; });
}

// What `baudgate check` says of all that the gateway keeps: events, readings of meters, the
// history.

/// Nothing where nothing is kept, as all of these.
void PrintEvents(const config::Config& config, std::ostream& out);
void PrintOfMeters(const config::Config& config, std::ostream& out);
void PrintHistory(const config::Config& config, std::ostream& out);
nlohmann::ordered_json HistoryJson(const config::Config& config);

// What `check` says of writes: which points may be written, and which could be if the device said
// so.

///   writes to feeder-1: setting_group (1 to 2, selected first)
///   writes to feeder-2: none; 5 points could be written (setting_group, …): add 'write: allow', …
void PrintWrites(const config::Line& line, std::ostream& out);

/// {"allowed":["setting_group"],"off":[]}: names of points that could be written.
nlohmann::ordered_json WritesJson(const config::Device& device);

// What `baudgate check` says of the web server.

/// Adds what is wrong with the token file.
void CheckWebToken(const config::Config& config, std::vector<config::Problem>& problems);

/// "web 127.0.0.1:8502, …", and how many series of metrics there are.
void PrintWeb(const config::Config& config, std::ostream& out);

/// The same for `--json`; null: it is off.
nlohmann::ordered_json WebJson(const config::Config& config);

// What becomes of every Modbus unit id: the table of `baudgate check`. Rows come from the
// configuration; text goes to the caller's stream.

/// One row, in the order in which requests are matched.
struct UnitRow {
  std::string units;     ///< "33-35, 37-40"; "others"
  std::string target;    ///< "line drive, slaves 1-3, 5-8"
  std::string deadline;  ///< "2.5s"; empty where none applies
};

/// Devices by unit, routes as configured (only with the units that they really get), the gateway
/// itself, all others.
std::vector<UnitRow> UnitRows(const config::Config& config);

void PrintRouteTable(const config::Config& config, std::ostream& out);

// What `baudgate check` says of Modbus listeners.

void PrintListener(const config::Listener& listener, std::ostream& out);
nlohmann::ordered_json ModbusJson(const config::Modbus& modbus);

}  // namespace baudgate::tools
