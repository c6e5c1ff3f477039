// `AuditJson`, `EventsJson` and `HistoryJson` return the states of the audit, the events and the
// history for the control socket; PageJson returns their records. HistoryCsvRow returns a row of
// the history as CSV.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "config/model/point.h"
#include "gateway/records/audit/audit_source.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::status {

/// Returns
/// {"state":"fine","since":…,"mode":"best_effort","trouble":"","waiting":0,"lost":0,"file":…,
///  "advice":[…]}
nlohmann::ordered_json AuditJson(const audit::AuditState& state);

nlohmann::ordered_json WriteJson(const audit::WriteRecord& record);

/// Returns {"records":[…],"next":412,"more":false}
nlohmann::ordered_json PageJson(const audit::Page& page);

/// Returns {"state":"fine","since":…,"trouble":"","newest":412,"oldest":1,
///  "consumers":[{"name":"dds","seq":412,"lost":0}],"waiting":0,"repeats":3,"left_out":0,
///  "alarms":{"active":1,"unacknowledged":1},"file":…,"in_memory":false,"advice":[…]}
nlohmann::ordered_json EventsJson(const events::EventsState& state);

nlohmann::ordered_json AlarmJson(const events::Alarm& alarm);
/// Returns the alarm that people should see first (events::IsWorse); null if there is no alarm.
nlohmann::ordered_json WorstJson(const std::vector<events::Alarm>& alarms);

/// Returns {"kind":"event","seq":7,…,"name":"trip","state":"read","values":[{"name":"trip_phases",
///  "value":4,"unit":"","quality":192,"quality_text":"good"}]}
nlohmann::ordered_json KeptRecordJson(const events::KeptRecord& record);

/// Returns {"records":[…],"next":412,"more":false}. A record has the form that `baudgate events
/// --json` prints.
nlohmann::ordered_json PageJson(const events::Page& page);

/// Returns {"state":"fine","since":…,"trouble":"","points":12,"readings":…,"advice":[…]}
nlohmann::ordered_json HistoryJson(const history::HistoryState& state);

/// Return {"records":[…],"next":[3,1790000000000],"more":false}. A record has the form that
/// `baudgate history --json` prints. `its`: the point of the configuration, which gives `shown`;
/// null: the point was removed.
nlohmann::ordered_json PageJson(const history::Page& page, const std::string& point,
                                const config::Point* its);
nlohmann::ordered_json PageJson(const history::TrendPage& page, const std::string& point);

// HistoryCsvHead and HistoryCsvRow write the CSV of `baudgate history --csv` and of the web page's
// download, from the records of PageJson.

/// Returns the head with its line end. `spans` true: each row summarizes a period, e.g. a minute;
/// false: each row is one value.
std::string HistoryCsvHead(bool spans);

/// Returns a row with its line end. Times have a form that spreadsheets can read; numbers are as in
/// `record`.
std::string HistoryCsvRow(const nlohmann::ordered_json& record, bool spans);

// EventsCsvHead and EventsCsvRow write the CSV of the web page's download of events.

std::string EventsCsvHead();
std::string EventsCsvRow(const nlohmann::ordered_json& record);

/// Returns the text for a record with a gap, e.g. "gap: the gateway was down until …".
std::string GapText(const nlohmann::ordered_json& record);

}  // namespace baudgate::status
