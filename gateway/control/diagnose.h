// Why a line or a device is not well and what to do about it, in one sentence each: from counters
// and states to words. Pure; shown by `baudgate status`, explained in docs/status.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gateway/line_status.h"
#include "gateway/point_store.h"

namespace baudgate::control {

/// Rarer trouble of a device that answers is not worth a sentence.
inline constexpr double kNotableShare = 0.01;

/// How the devices of a line are, counted.
struct LineDevices {
  std::size_t in_use = 0;
  std::size_t absent = 0;  ///< of those in use: asked and without an answer, or offline
};

/// Empty when the line is well; the most important sentence first.
std::vector<std::string> DiagnoseLine(const config::Line& line, const LineStatus& status,
                                      LineDevices devices, Now now);

/// Empty when the device is well, or when its line is not open: then the line's sentence explains
/// it. `started`: when the gateway began to poll.
std::vector<std::string> Diagnose(const LineStatus& line, const DeviceRecord& device, Now now,
                                  Instant started);

/// Asked, and not there.
bool IsAbsent(const DeviceStatus& status);

/// "12:04:05 UTC".
std::string ClockText(WallTime time);

}  // namespace baudgate::control
