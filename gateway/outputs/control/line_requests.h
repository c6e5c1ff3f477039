// Requests about lines and their devices: `status`, `settings`, `release`, `take_back`, `enable`,
// `disable`, `trace` and `recorded`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/outputs/control/request.h"

namespace baudgate::control {

/// The longest time that a port is lent; longer needs a second call.
inline constexpr Duration kMostRelease = 24h;

Reply ShowStatus(const Gateway& gateway, const Request& request);
Reply ShowSettings(const Gateway& gateway, const Request& request);
/// The port of a line is lent: to a program that opens it, or to clients of a TCP port.
Reply Release(const Gateway& gateway, const Request& request);
Reply TakeBack(const Gateway& gateway, const Request& request);
Reply Enable(const Gateway& gateway, const Request& request);
Reply Disable(const Gateway& gateway, const Request& request);
Reply Trace(const Gateway& gateway, const Request& request);
/// Shows the records in the flight recorder of a line.
Reply ShowRecorded(const Gateway& gateway, const Request& request);

/// {"record":"…"}: a record of a trace as it travels.
std::string RecordLine(const TraceRecord& record);
bool Wanted(const TraceWish& wish, const TraceRecord& record);

}  // namespace baudgate::control
