// Why a line or a device is not well and what to do about it, in one sentence each: from counters
// and states to words. Pure; shown by `baudgate status`, explained in docs/status.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "gateway/bus/points/line_status.h"
#include "gateway/bus/points/point_store.h"

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

}  // namespace baudgate::control
