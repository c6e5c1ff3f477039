// Requests about what is kept: `writes`, `events`, `alarms`, `ack`, `history` and `kept_points`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "gateway/base/result.h"
#include "gateway/outputs/control/request.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/past_table.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::control {

// The requests `alarms` and `ack` of the control socket.

/// One page, by the numbers of the events that have raised them.
Json AlarmsPage(const events::EventSource& events, std::int64_t after);

/// "bay-1" (of the line itself), "bay-1.feeder-1", "bay-1.feeder-1.current_l1" or "412"; or what
/// events::PlaceOf says. An error where there is no such device
/// or point; of a device that is not configured any more alarms may still be there.
Result<events::AckQuery> FindAlarms(const config::Config& config, const events::EventSource& events,
                                    const std::string& target);

/// {"ok":true,"acknowledged":2,"trouble":""}.
Json AckJson(const events::Acknowledged& done);

// What meters have measured and kept themselves, for `baudgate history`:
// LINE.DEVICE.load_1.active_import.

/// Four parts: of the past, as points have three. With line, device and name; empty: three or
/// fewer.
std::optional<events::PastQuery> PastQueryOf(const std::string& text);

/// {"records":[…],"next":[4711,1790000000000000],"more":false}; a record as `baudgate history
/// --json` prints it, with "seconds", of how long it is.
nlohmann::ordered_json PageJson(const events::PastPage& page, const std::string& point);

// The requests `history` and `kept_points` of the control socket.

/// Where values are kept; null: nowhere.
struct KeptValues {
  const config::Config& config;
  const history::HistorySource* history = nullptr;
  const events::EventSource* events = nullptr;
};

/// One page of a point, or of what a meter has measured itself; or {"error":…}. A point that is not
/// configured any more still has its values; of one that has none it is said why.
Json HistoryPage(const Json& request, const KeptValues& kept);

/// {"points":["bay-1.feeder-1.current_l1"]}: whose values are kept, of those that a pattern means.
/// By the configuration: a point that is not in it any more has to be named.
Json KeptPoints(const Json& request, const KeptValues& kept);

Reply ShowWrites(const Gateway& gateway, const Request& request);
Reply ShowEvents(const Gateway& gateway, const Request& request);
Reply ShowAlarms(const Gateway& gateway, const Request& request);
Reply Acknowledge(const Gateway& gateway, const Request& request);
Reply ShowHistory(const Gateway& gateway, const Request& request);
Reply ShowKeptPoints(const Gateway& gateway, const Request& request);

}  // namespace baudgate::control
