// Functions that print the parts of `baudgate check`.
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

inline std::string Whom(const std::vector<config::Network>& allow) {
  if (allow.empty()) return "everybody who can connect";
  return Joined(allow, [](const auto& network) { return network.text; });
}

/// The functions for events, meters and history print nothing if the configuration records none.
void PrintEvents(const config::Config& config, std::ostream& out);
void PrintOfMeters(const config::Config& config, std::ostream& out);
void PrintHistory(const config::Config& config, std::ostream& out);
/// Prints how long an outage of a receiver of stored values can last without a loss.
void PrintOutlets(const config::Config& config, std::ostream& out);
nlohmann::ordered_json HistoryJson(const config::Config& config);

/// Prints the writable points of each device. Example:
///   writes to feeder-1: setting_group (1 to 2, selected first)
///   writes to feeder-2: none; setting_group can be written if you add 'write: allow', …
void PrintWrites(const config::Line& line, std::ostream& out);

/// Returns the points that the configuration allows to be written, and points that could be
/// allowed. Example: {"allowed":["setting_group"],"off":["reset"]}.
nlohmann::ordered_json WritesJson(const config::Device& device);

/// Checks the token file, the users file and the certificates. Their problems are
/// warnings, because the user of `check` perhaps has no permission to read the files.
void CheckSecurityFiles(const config::Config& config, WallTime now,
                        std::vector<config::Problem>& problems);

/// Prints e.g. "mqtt mqtts://broker.example:8883 as baudgate-gate-1, json to
/// plant/gate-1/{line}/…"; nothing if MQTT is off.
void PrintMqtt(const config::Config& config, std::ostream& out);

/// Prints the address of the web server, "web http://127.0.0.1:8502/, …", and the number of metric
/// series; prints "web off" if there is no web server.
void PrintWeb(const config::Config& config, std::ostream& out);

/// Returns the part of `baudgate check --json` about the web server; null: there is no web server.
nlohmann::ordered_json WebJson(const config::Config& config);

/// One row of the routing table. The rows are in the order in which requests are matched.
struct UnitRow {
  std::string units;     ///< Modbus units: "33-35, 37-40", or "others"
  std::string target;    ///< destination of requests to the units: "line drive, slaves 1-3, 5-8"
  std::string deadline;  ///< "2.5s"; empty: the target has no deadline
};

/// Returns the rows in this order: devices by unit, routes as configured (with only the units that
/// no earlier row takes), the gateway itself, all other units.
std::vector<UnitRow> UnitRows(const config::Config& config);

void PrintRouteTable(const config::Config& config, std::ostream& out);

void PrintListener(const config::Listener& listener, std::ostream& out);
nlohmann::ordered_json ModbusJson(const config::Modbus& modbus);

}  // namespace baudgate::tools
