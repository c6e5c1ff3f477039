// The port of a line in words: its control lines, and the clients that may have it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace baudgate {

/// "DTR RTS CTS": those that are on, of `modem` in the status; empty: the port has none.
std::string ControlLinesText(const nlohmann::ordered_json& modem);
/// Facts of a line's status: "lines" and "clients", where there are any.
std::vector<std::pair<std::string, std::string>> PortFacts(const nlohmann::ordered_json& line);

}  // namespace baudgate
