// Modbus clients, serial masters and transparent routes (gateway/outputs/status/traffic_json.h) as
// text for people: a part of `baudgate status`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate {

/// A table of routes, one of masters and one of clients, each behind an empty line; nothing for
/// those of which there are none.
std::string RenderTraffic(const nlohmann::ordered_json& modbus, const TableView& view);

}  // namespace baudgate
