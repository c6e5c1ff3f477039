// `AuditJson`, `EventsJson` and `HistoryJson` return the states of the audit, the events and the
// history for the control socket, PageJson their records. HistoryCsvRow writes the history as CSV.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "gateway/records/audit/audit_source.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::status {

/// Returns
/// {"state":"fine","since":…,"mode":"best_effort","trouble":"","waiting":0,"lost":0,"file":…,
///  "advice":[…]}
nlohmann::ordered_json AuditJson(const audit::AuditState& state);

/// As `baudgate writes --json` prints it.
nlohmann::ordered_json WriteJson(const audit::WriteRecord& record);

/// Returns {"records":[…],"next":412,"more":false}
nlohmann::ordered_json PageJson(const audit::Page& page);

/// Returns {"state":"fine","since":…,"trouble":"","newest":412,"oldest":1,
///  "consumers":[{"name":"dds","seq":412,"lost":0}],"waiting":0,"repeats":3,"left_out":0,
///  "alarms":{"active":1,"unacknowledged":1},"file":…,"in_memory":false,"advice":[…]}
nlohmann::ordered_json EventsJson(const events::EventsState& state);

/// As `baudgate alarms --json` prints it.
nlohmann::ordered_json AlarmJson(const events::Alarm& alarm);

/// Returns {"kind":"event","seq":7,…,"name":"trip","state":"read","values":[{"name":"trip_phases",
///  "value":4,"unit":"","quality":192,"quality_text":"good"}]}
nlohmann::ordered_json KeptRecordJson(const events::KeptRecord& record);

/// Returns {"records":[…],"next":412,"more":false}; each record as `baudgate events --json` prints
/// it.
nlohmann::ordered_json PageJson(const events::Page& page);

/// Returns {"state":"fine","since":…,"trouble":"","points":12,"readings":…,"advice":[…]}
nlohmann::ordered_json HistoryJson(const history::HistoryState& state);

/// Return {"records":[…],"next":[3,1790000000000],"more":false}; each record as `baudgate history
/// --json` prints it.
nlohmann::ordered_json PageJson(const history::Page& page, const std::string& point);
nlohmann::ordered_json PageJson(const history::TrendPage& page, const std::string& point);

// The CSV of `baudgate history --csv` and of the page's download, made from the records of
// PageJson.

/// `spans`: the rows are minutes, hours, … and not single values. With the line end.
std::string HistoryCsvHead(bool spans);

/// With the line end. Times are as spreadsheets read them; numbers are unchanged.
std::string HistoryCsvRow(const nlohmann::ordered_json& record, bool spans);

/// E.g. "gap: the gateway was down until …", for a record with a gap.
std::string GapText(const nlohmann::ordered_json& record);

}  // namespace baudgate::status
