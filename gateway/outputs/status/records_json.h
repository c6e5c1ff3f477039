// The audit in the answers of the control socket: how it is, and its records. EventsJson,
// HistoryJson and HistoryCsvRow write the events and the history.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "gateway/records/audit/audit_source.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::status {

/// {"state":"fine","since":…,"mode":"best_effort","trouble":"","waiting":0,"lost":0,"file":…,
///  "advice":[…]}
nlohmann::ordered_json AuditJson(const audit::AuditState& state);

/// One write, as `baudgate writes --json` prints it.
nlohmann::ordered_json WriteJson(const audit::WriteRecord& record);

/// {"records":[…],"next":412,"more":false}
nlohmann::ordered_json PageJson(const audit::Page& page);

// The events in the answers of the control socket: how they are kept, and the records.

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

// The history in the answers of the control socket: how it is kept, and what it holds.

/// {"state":"fine","since":…,"trouble":"","points":12,"readings":…,"advice":[…]}
nlohmann::ordered_json HistoryJson(const history::HistoryState& state);

/// {"records":[…],"next":[3,1790000000000],"more":false}; a record as `baudgate history --json`
/// prints it.
nlohmann::ordered_json PageJson(const history::Page& page, const std::string& point);
nlohmann::ordered_json PageJson(const history::TrendPage& page, const std::string& point);

// The history for spreadsheets: `baudgate history --csv`, and the download of the page. Made of the
// records that PageJson returns.

/// `spans`: of minutes, hours, …, not of single values. With the end of the line.
std::string HistoryCsvHead(bool spans);

/// Times as spreadsheets know them; numbers as they are.
std::string HistoryCsvRow(const nlohmann::ordered_json& record, bool spans);

/// "gap: the gateway was down until …".
std::string GapText(const nlohmann::ordered_json& record);

}  // namespace baudgate::status
