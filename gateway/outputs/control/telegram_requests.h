// Requests of the control socket for telegrams by hand: completed and judged by the protocol of the
// line, allowed or denied, recorded where they may write, and sent in their turn.
//
//   {"command":"ask","target":"bay","telegram":"3E 31 52 46 3A"}
//   {"sent":"3E 31 52 46 3A 32 31 0D","received":"0A 3C …","outcome":"ok","reason":""}
//
// "sent" is empty, and "reason" says why, if nothing was sent.
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/lines/line_control.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::control {

/// `target`: LINE or LINE.DEVICE, whose protocol and options it has; `telegram` in hex, as it was
/// written; `write`: it may write. The error is one sentence; without one `answered` is called
/// once, on any thread. All references outlive what was asked.
Status AskManually(const config::Config& config, LineControl& control, CommandSink& sink,
                   const Json& request, const Writer& writer, Instant now,
                   const std::function<void(const Json&)>& answered);

}  // namespace baudgate::control
