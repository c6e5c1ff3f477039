// Functions that render Modbus clients, serial masters and transparent routes
// (gateway/outputs/modbus/service/traffic_json.h) as text for `baudgate status`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate::tools {

/// Example: "DTR RTS CTS": those that are on. Empty: none.
std::string ControlLinesText(const nlohmann::ordered_json& modem);
/// Modem control lines and clients of the port, if the status contains them.
std::vector<std::pair<std::string, std::string>> PortFacts(const nlohmann::ordered_json& line);

/// Tables of routes, masters and clients, each after an empty line.
std::string RenderTraffic(const nlohmann::ordered_json& modbus, const TableView& view);

}  // namespace baudgate::tools
