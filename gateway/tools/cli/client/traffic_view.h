// Modbus clients, serial masters and transparent routes
// (gateway/outputs/modbus/service/traffic_json.h) as text for people: a part of `baudgate status`.
// ControlLinesText and PortFacts show the port of a line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate::tools {

// The port of a line in words: its control lines, and the clients that may have it.

/// "DTR RTS CTS": those that are on, of `modem` in the status; empty: the port has none.
std::string ControlLinesText(const nlohmann::ordered_json& modem);
/// Facts of a line's status: "lines" and "clients", where there are any.
std::vector<std::pair<std::string, std::string>> PortFacts(const nlohmann::ordered_json& line);

/// A table of routes, one of masters and one of clients, each behind an empty line; nothing for
/// those of which there are none.
std::string RenderTraffic(const nlohmann::ordered_json& modbus, const TableView& view);

}  // namespace baudgate::tools
