// What is not well with serial masters, routes and clients of the Modbus server, in one sentence
// each. Pure.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/outputs/modbus/service/traffic.h"

namespace baudgate::control {

/// A master that says nothing for so long has stopped polling: panels and PLCs ask all the time.
inline constexpr Duration kSilentMaster = 1min;
/// More damage than that is not an occasional disturbance.
inline constexpr double kNotableDamage = 0.01;

/// Empty when it is heard well.
std::vector<std::string> DiagnoseMaster(const modbus::MasterStatus& master, WallTime now);

std::string DiagnoseOther(const modbus::OtherSpeaker& other, WallTime now);

/// Empty when every request has had a good reply.
std::vector<std::string> DiagnoseRoute(const modbus::RouteStatus& route, WallTime now);

}  // namespace baudgate::control
