// `ShowWrites` and the functions below answer the requests about stored records: `writes`,
// `events`, `alarms`, `ack`, `history` and `kept_points`.
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

/// Returns a page of values that a meter has stored itself, e.g. of
/// LINE.DEVICE.load_1.active_import: {"records":[…],"next":[4711,1790000000000000],"more":false}. A
/// record has the form that `baudgate history --json` prints; "seconds" is the length of its
/// interval.
nlohmann::ordered_json PageJson(const events::PastPage& page, const std::string& point);

// Each function answers the request of the same name.

Reply ShowWrites(const Gateway& gateway, const Request& request);
Reply ShowEvents(const Gateway& gateway, const Request& request);
Reply ShowAlarms(const Gateway& gateway, const Request& request);
Reply Acknowledge(const Gateway& gateway, const Request& request);
Reply ShowHistory(const Gateway& gateway, const Request& request);
Reply ShowKeptPoints(const Gateway& gateway, const Request& request);

}  // namespace baudgate::control
