// The events in the answers of the control socket: how they are kept, and the records.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "gateway/records/events/event_source.h"

namespace baudgate::control {

/// {"state":"fine","since":…,"trouble":"","newest":412,"oldest":1,
///  "consumers":[{"name":"dds","seq":412,"lost":0}],"waiting":0,"repeats":3,"left_out":0,
///  "alarms":{"active":1,"unacknowledged":1},"file":…,"in_memory":false,"advice":[…]}
nlohmann::ordered_json EventsJson(const events::EventsState& state);

/// As `baudgate alarms --json` prints it.
nlohmann::ordered_json AlarmJson(const events::Alarm& alarm);

/// {"kind":"event","seq":7,…,"name":"trip","state":"read","values":[{"name":"trip_phases",
///  "value":4,"unit":"","quality":192,"quality_text":"good"}]}
nlohmann::ordered_json KeptRecordJson(const events::KeptRecord& record);

/// {"records":[…],"next":412,"more":false}; a record as `baudgate events --json` prints it.
nlohmann::ordered_json PageJson(const events::Page& page);

}  // namespace baudgate::control
