// `TrafficJson` returns Modbus clients, serial masters and transparent routes for `baudgate
// status`. docs/status-reference.md describes every field; fields are only ever added.
// `DiagnoseMaster`, `DiagnoseOther` and `DiagnoseRoute` describe problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/modbus/service/traffic.h"

namespace baudgate::modbus {

/// Returns
/// {"clients":[…],"masters":[…],"closed":[…],"other_framing":[…],"routes":[…],"labels":{…}}. With
/// `line`, only the routes that lead to it are included.
nlohmann::ordered_json TrafficJson(const modbus::TrafficStatus& traffic, const std::string& line,
                                   Now now);

/// A silent master has stopped polling, because panels and PLCs poll all the time.
inline constexpr Duration kSilentMaster = 1min;
/// More damaged frames are reported; occasional disturbances cause less.
inline constexpr double kNotableDamage = 0.01;

/// Returns sentences about problems with a master; empty: its requests arrive undamaged.
std::vector<std::string> DiagnoseMaster(const modbus::MasterStatus& master, WallTime now);

std::string DiagnoseOther(const modbus::OtherSpeaker& other, WallTime now);

/// Returns sentences about the problems of a route; empty: every request had a good reply.
std::vector<std::string> DiagnoseRoute(const modbus::RouteStatus& route, WallTime now);

}  // namespace baudgate::modbus
