// Requests about lines and their devices: `status`, `settings`, `release`, `take_back`, `enable`,
// `disable`, `trace` and `recorded`. AskManually handles telegrams by hand.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/lines/line_control.h"
#include "gateway/outputs/control/request.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::control {

// Requests of the control socket for telegrams by hand: completed and judged by the protocol of the
// line, allowed or denied, recorded where they may write, and sent in their turn.
//
//   {"command":"ask","target":"bay","telegram":"3E 31 52 46 3A"}
//   {"sent":"3E 31 52 46 3A 32 31 0D","received":"0A 3C …","outcome":"ok","reason":""}
//
// "sent" is empty, and "reason" says why, if nothing was sent.

/// `target`: LINE or LINE.DEVICE, whose protocol and options it has; `telegram` in hex, as it was
/// written; `write`: it may write. The error is one sentence; without one `answered` is called
/// once, on any thread. All references outlive what was asked.
Status AskManually(const config::Config& config, LineControl& control, CommandSink& sink,
                   const Json& request, const Writer& writer, Instant now,
                   const std::function<void(const Json&)>& answered);

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
