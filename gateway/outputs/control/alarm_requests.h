// The requests `alarms` and `ack` of the control socket. Part of record_requests.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "gateway/base/result.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/outputs/status/target.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::control {

/// One page, by the numbers of the events that have raised them.
Json AlarmsPage(const events::EventSource& events, std::int64_t after);

/// "bay-1" (of the line itself), "bay-1.feeder-1", "bay-1.feeder-1.current_l1" or "412"; or what
/// events::PlaceOf says. An error where there is no such device
/// or point; of a device that is not configured any more alarms may still be there.
Result<events::AckQuery> FindAlarms(const config::Config& config, const events::EventSource& events,
                                    const std::string& target);

/// {"ok":true,"acknowledged":2,"trouble":""}.
Json AckJson(const events::Acknowledged& done);

}  // namespace baudgate::control
