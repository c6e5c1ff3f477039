// Modbus clients, serial masters and transparent routes as JSON: a part of the answer to `baudgate
// status`. docs/status.md has it field by field; fields are only ever added. DiagnoseMaster,
// DiagnoseOther and DiagnoseRoute say in one sentence each what is not well. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/modbus/service/traffic.h"

namespace baudgate::modbus {

/// {"clients":[…],"masters":[…],"closed":[…],"other_framing":[…],"routes":[…],"labels":{…}}. With
/// `line` only the routes that lead to that line; the other arrays are empty.
nlohmann::ordered_json TrafficJson(const modbus::TrafficStatus& traffic, const std::string& line,
                                   Now now);

/// A master that says nothing for so long has stopped polling: panels and PLCs ask all the time.
inline constexpr Duration kSilentMaster = 1min;
/// More damage than that is not an occasional disturbance.
inline constexpr double kNotableDamage = 0.01;

/// Empty when it is heard well.
std::vector<std::string> DiagnoseMaster(const modbus::MasterStatus& master, WallTime now);

std::string DiagnoseOther(const modbus::OtherSpeaker& other, WallTime now);

/// Empty when every request has had a good reply.
std::vector<std::string> DiagnoseRoute(const modbus::RouteStatus& route, WallTime now);

}  // namespace baudgate::modbus
