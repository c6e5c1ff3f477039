// Requests about what is kept: `writes`, `events`, `alarms`, `ack`, `history` and `kept_points`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "gateway/base/result.h"
#include "gateway/outputs/control/request.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/record_table.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::control {

// What meters have measured and kept themselves, for `baudgate history`:
// LINE.DEVICE.load_1.active_import.

/// {"records":[…],"next":[4711,1790000000000000],"more":false}; a record as `baudgate history
/// --json` prints it, with "seconds", of how long it is.
nlohmann::ordered_json PageJson(const events::PastPage& page, const std::string& point);

// The requests `history` and `kept_points` of the control socket.

Reply ShowWrites(const Gateway& gateway, const Request& request);
Reply ShowEvents(const Gateway& gateway, const Request& request);
Reply ShowAlarms(const Gateway& gateway, const Request& request);
Reply Acknowledge(const Gateway& gateway, const Request& request);
Reply ShowHistory(const Gateway& gateway, const Request& request);
Reply ShowKeptPoints(const Gateway& gateway, const Request& request);

}  // namespace baudgate::control
