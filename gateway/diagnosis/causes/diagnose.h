// Why a line or a device is not well and what to do about it, in one sentence each: from counters
// and states to words. Pure; shown by `baudgate status`, explained in docs/status.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "gateway/bus/points/line_status.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/modbus/service/traffic.h"

namespace baudgate::control {

/// Empty when the line is well; the most important sentence first. `devices`: all of the line.
/// `started`: when the gateway began to poll.
std::vector<std::string> DiagnoseLine(const config::Line& line, const LineStatus& status,
                                      std::span<const DeviceRecord> devices, Now now,
                                      Instant started);

/// Empty when the device is well, or when its line is not open: then the line's sentence explains
/// it.
std::vector<std::string> DiagnoseDevice(const LineStatus& line, const DeviceRecord& device,
                                        std::span<const DeviceRecord> devices, Now now,
                                        Instant started);

/// "12:04:05 UTC".
std::string ClockText(WallTime time);

// ---------------- gateway/outputs/status/diagnose_modbus.cpp: a serial master or a transparent
// route

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
