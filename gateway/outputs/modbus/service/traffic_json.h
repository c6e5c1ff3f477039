// `TrafficJson` returns Modbus clients, serial masters and transparent routes as JSON, a part of
// the answer to `baudgate status`. docs/status-reference.md describes every field; later versions
// may only add fields. `DiagnoseMaster`, `DiagnoseOther` and `DiagnoseRoute` describe each problem
// in one sentence.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/modbus/service/traffic.h"

namespace baudgate::modbus {

/// Returns
/// {"clients":[…],"masters":[…],"closed":[…],"other_framing":[…],"routes":[…],"labels":{…}}. If
/// `line` is not empty, `routes` contains only the routes that lead to this line, and the other
/// arrays are empty.
nlohmann::ordered_json TrafficJson(const modbus::TrafficStatus& traffic, const std::string& line,
                                   Now now);

/// A master that has been silent for this time is reported, because panels and PLCs poll all the
/// time.
inline constexpr Duration kSilentMaster = 1min;
/// A share of damaged frames above this limit is reported, because occasional disturbances cause
/// less.
inline constexpr double kNotableDamage = 0.01;

/// Returns sentences about problems with a master; empty: there are none.
std::vector<std::string> DiagnoseMaster(const modbus::MasterStatus& master, WallTime now);

std::string DiagnoseOther(const modbus::OtherSpeaker& other, WallTime now);

/// Returns sentences about late replies, and about the trouble of the last ten minutes. Empty:
/// there are no problems.
std::vector<std::string> DiagnoseRoute(const modbus::RouteStatus& route, WallTime now);

}  // namespace baudgate::modbus
