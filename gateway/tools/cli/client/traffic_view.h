// Renders Modbus clients, serial masters and transparent routes
// (gateway/outputs/modbus/service/traffic_json.h) as text for `baudgate status`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate::tools {

/// Returns the control lines that are on in `modem`: "DTR RTS CTS"; empty: the port has none.
std::string ControlLinesText(const nlohmann::ordered_json& modem);
/// Returns labelled facts of a line's status: "lines" and "clients", if there are any.
std::vector<std::pair<std::string, std::string>> PortFacts(const nlohmann::ordered_json& line);

/// Returns tables of routes, masters and clients, each after an empty line. Empty tables are left
/// out.
std::string RenderTraffic(const nlohmann::ordered_json& modbus, const TableView& view);

}  // namespace baudgate::tools
