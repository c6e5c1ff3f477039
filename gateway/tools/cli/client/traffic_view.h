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

/// Returns the modem control lines that are on, for example "DTR RTS CTS", or "no control line on".
/// Empty: the port has no control lines.
std::string ControlLinesText(const nlohmann::ordered_json& modem);
/// Returns labelled facts about the port of a line: the modem control lines, and the clients that
/// use the port. Leaves out what the status does not contain.
std::vector<std::pair<std::string, std::string>> PortFacts(const nlohmann::ordered_json& line);

/// Returns tables of routes, masters and clients, each after an empty line. Leaves out empty
/// tables.
std::string RenderTraffic(const nlohmann::ordered_json& modbus, const TableView& view);

}  // namespace baudgate::tools
