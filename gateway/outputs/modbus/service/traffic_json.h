// Modbus clients, serial masters and transparent routes as JSON: a part of the answer to `baudgate
// status`. docs/status.md has it field by field; fields are only ever added.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "gateway/outputs/modbus/service/traffic.h"

namespace baudgate::control {

/// {"clients":[…],"masters":[…],"closed":[…],"routes":[…],"labels":{"route":{…}}}; with `line` only
/// the routes that lead to it, and nothing else.
nlohmann::ordered_json TrafficJson(const modbus::TrafficStatus& traffic, const std::string& line,
                                   Now now);

}  // namespace baudgate::control
