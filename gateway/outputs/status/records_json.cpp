// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/records_json.h"

#include <algorithm>
#include <string>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/outputs/status/status_json.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::status {

using Json = nlohmann::ordered_json;

namespace {

Json AdviceOf(const audit::AuditState& state) {
  Json advice = Json::array();
  if (!state.trouble.empty()) {
    std::string text = state.trouble;
    text += state.require
                ? "; writes to points are refused until the file can be written (audit: require)"
                : "; writes are still sent, and their records wait in memory (audit: best_effort)";
    if (state.waiting > 0) text += "; waiting: " + Plural(state.waiting, "record");
    advice.push_back(text);
  }
  if (state.lost > 0) {
    advice.push_back(Plural(state.lost, "record") + " of writes lost since the start: the queue " +
                     "was full while the disk failed; check the disk (dmesg)");
  }
  const std::filesystem::path folder = std::filesystem::path(state.file).parent_path();
  const std::string aside = PutAsideAdvice(folder, state.put_aside);
  if (!aside.empty()) advice.push_back(aside);
  return advice;
}

}  // namespace

Json AuditJson(const audit::AuditState& state) {
  Json json;
  json["state"] = Name(state.disk);
  json["since"] = TimeJson(state.since);
  json["mode"] = state.require ? "require" : "best_effort";
  json["trouble"] = state.trouble;
  json["waiting"] = state.waiting;
  json["lost"] = state.lost;
  json["file"] = state.file;
  json["put_aside"] = state.put_aside;
  json["advice"] = AdviceOf(state);
  return json;
}

Json WriteJson(const audit::WriteRecord& record) {
  Json json;
  json["seq"] = record.seq;
  json["time"] = FormatWallTime(record.time);
  json["client"] = record.client;
  json["request"] = nullptr;
  if (record.request) {
    json["request"] = {{"client", Harmless(record.request->client)}, {"seq", record.request->seq}};
  }
  json["line"] = record.line;
  json["device"] = record.device;
  json["point"] = record.point;
  json["old"] = ValueJson(record.before);
  json["new"] = ValueJson(record.value);
  json["outcome"] = audit::OutcomeOf(record);
  json["reason"] = record.reason;
  json["took_ms"] = std::chrono::duration<double, std::milli>(
                        std::chrono::floor<std::chrono::microseconds>(record.took))
                        .count();
  json["count"] = record.count;
  json["first"] = ValueJson(record.first);
  json["last_time"] = FormatWallTime(record.last);
  json["kind"] = audit::Name(record.kind);
  return json;
}

Json PageJson(const audit::Page& page) {
  Json records = Json::array();
  for (const audit::WriteRecord& record : page.records) records.push_back(WriteJson(record));
  return {{"records", std::move(records)}, {"next", page.next}, {"more", page.more}};
}

using Json = nlohmann::ordered_json;

namespace {

Json AdviceOf(const events::EventsState& state) {
  Json advice = Json::array();
  if (!state.trouble.empty()) {
    std::string text =
        state.trouble + "; devices are not polled for events until the file can be written";
    if (state.waiting > 0)
      text += "; waiting in memory: the events of " + Plural(state.waiting, "read");
    advice.push_back(text);
  }
  const std::filesystem::path folder = std::filesystem::path(state.file).parent_path();
  const std::string aside = PutAsideAdvice(folder, state.put_aside);
  if (!aside.empty()) advice.push_back(aside);
  return advice;
}

Json RecordJson(const events::EventRecord& record) {
  Json json;
  json["seq"] = record.seq;
  json["receive_time"] = FormatWallTime(record.received);
  json["device_time"] = FormatWallTime(record.device_time);
  json["clock_quality"] = static_cast<std::uint16_t>(record.clock);
  json["line"] = record.line;
  json["device"] = record.device;
  json["channel"] = record.channel;
  json["code"] = record.code;
  json["state"] = config::Name(record.state);
  json["priority"] = events::kEventPriorities[static_cast<std::size_t>(PriorityOf(record))];
  json["text"] = record.text;
  if (record.kept) {
    json["record"] = KeptRecordJson(*record.kept);
  } else if (!record.record.empty()) {
    json["record"] = {{"name", record.record}, {"state", "owed"}};
  }
  return json;
}

}  // namespace

Json KeptRecordJson(const events::KeptRecord& record) {
  Json json;
  json["kind"] = record.kind;
  json["seq"] = record.seq;
  json["line"] = record.line;
  json["device"] = record.device;
  json["name"] = record.name;
  json["event"] = record.event;
  json["device_time"] = FormatWallTime(record.device_time);
  json["clock_quality"] = static_cast<std::uint16_t>(record.clock);
  json["read_time"] = FormatWallTime(record.read);
  json["state"] = Name(record.state);
  json["text"] = record.text;
  Json values = Json::array();
  for (const events::RecordValue& value : record.values) {
    values.push_back({{"name", value.name},
                      {"value", ValueJson(value.value)},
                      {"unit", value.unit},
                      {"quality", value.quality.word()},
                      {"quality_text", Name(value.quality)}});
  }
  json["values"] = std::move(values);
  return json;
}

Json EventsJson(const events::EventsState& state) {
  Json json;
  json["state"] = Name(state.disk);
  json["since"] = TimeJson(state.since);
  json["trouble"] = state.trouble;
  json["newest"] = state.newest;
  json["oldest"] = state.oldest;
  json["consumers"] = Json::array();
  for (const events::Consumer& one : state.consumers) {
    json["consumers"].push_back({{"name", one.name}, {"seq", one.seq}, {"lost", one.lost}});
  }
  json["waiting"] = state.waiting;
  json["repeats"] = state.repeats;
  json["left_out"] = state.left_out;
  json["alarms"] = {{"active", state.alarms_active},
                    {"unacknowledged", state.alarms_unacknowledged}};
  json["file"] = state.file;
  json["put_aside"] = state.put_aside;
  json["in_memory"] = state.in_memory;
  json["advice"] = AdviceOf(state);
  return json;
}

Json AlarmJson(const events::Alarm& alarm) {
  Json json;
  json["seq"] = alarm.seq;
  json["state"] = Name(alarm.state);
  json["priority"] = Name(alarm.priority);
  json["line"] = alarm.line;
  json["device"] = alarm.device;
  json["point"] = alarm.point;
  json["name"] = alarm.name;
  json["raised"] = FormatWallTime(alarm.raised);
  json["changed"] = FormatWallTime(alarm.changed);
  json["text"] = alarm.text;
  json["acknowledged_by"] = alarm.by;
  json["unacknowledged"] = events::IsUnacknowledged(alarm.state);
  return json;
}

Json WorstJson(const std::vector<events::Alarm>& alarms) {
  const auto worst = std::ranges::min_element(alarms, events::IsWorse);
  return worst == alarms.end() ? Json(nullptr) : AlarmJson(*worst);
}

Json PageJson(const events::Page& page) {
  Json records = Json::array();
  for (const events::EventRecord& record : page.records) records.push_back(RecordJson(record));
  return {{"records", std::move(records)}, {"next", page.next}, {"more", page.more}};
}

using Json = nlohmann::ordered_json;

namespace {

Json AdviceOf(const history::HistoryState& state) {
  Json advice = Json::array();
  if (!state.trouble.empty()) {
    advice.push_back(state.trouble +
                     "; values wait in a queue, and are dropped when the queue is full");
  }
  for (const std::string& text : state.unread) {
    advice.push_back(text +
                     "; query results lack values of this file: repair the file or move it away");
  }
  const std::string aside = PutAsideAdvice(state.folder, state.put_aside);
  if (!aside.empty()) advice.push_back(aside);
  if (state.counters.dropped > 0) {
    advice.push_back(
        Plural(state.counters.dropped, "value") +
        " dropped since the start, because the disk did not take them: the history has a gap");
  }
  return advice;
}

/// Returns a record of the history. The value and the quality of a gap are null, because they are
/// unknown.
Json RecordJson(const history::HistoryRecord& record, const std::string& point,
                const config::Point* its) {
  Json json = {{"time", FormatWallTime(history::ToWall(record.entry.time))}, {"point", point}};
  if (record.gap) {
    json["value"] = nullptr;
    json["quality"] = nullptr;
    json["gap"] = Name(record.gap->why);
    json["until"] = FormatWallTime(history::ToWall(record.gap->until));
    return json;
  }
  json["value"] = ValueJson(record.entry.value);
  json["shown"] =
      its != nullptr ? config::ShownText(*its, record.entry.value) : ToText(record.entry.value);
  json["quality"] = record.entry.quality.word();
  json["quality_text"] = Name(record.entry.quality);
  return json;
}

}  // namespace

Json HistoryJson(const history::HistoryState& state) {
  Json json;
  json["state"] = Name(state.disk);
  json["since"] = TimeJson(state.since);
  json["trouble"] = state.trouble;
  json["points"] = state.points;
  json["readings"] = state.counters.readings;
  json["kept"] = state.counters.kept;
  json["merged"] = state.counters.merged;
  json["dropped"] = state.counters.dropped;
  json["spans_dropped"] = state.trends_dropped;
  json["waiting"] = state.waiting;
  json["bytes"] = state.bytes;
  json["limit"] = state.limit;
  json["oldest"] = TimeJson(state.oldest);
  json["folder"] = state.folder;
  json["put_aside"] = state.put_aside;
  json["advice"] = AdviceOf(state);
  return json;
}

Json PageJson(const history::Page& page, const std::string& point, const config::Point* its) {
  Json records = Json::array();
  for (const history::HistoryRecord& record : page.records) {
    records.push_back(RecordJson(record, point, its));
  }
  Json unread = Json::array();
  for (const history::UnreadFile& file : page.unread) unread.push_back(file.text);
  return {{"records", std::move(records)},
          {"next", Json::array({page.next.run, page.next.time})},
          {"more", page.more},
          {"unread", std::move(unread)}};
}

Json PageJson(const history::TrendPage& page, const std::string& point) {
  Json records = Json::array();
  for (const history::Trend& span : page.spans) {
    Json json = {{"time", FormatWallTime(history::ToWall(span.begin))}, {"point", point}};
    json["mean"] = span.mean;
    json["min"] = span.min;
    json["max"] = span.max;
    json["first"] = span.first;
    json["last"] = span.last;
    json["count"] = span.count;
    json["seconds_good"] = static_cast<double>(span.good) / 1000;
    records.push_back(std::move(json));
  }
  return {
      {"records", std::move(records)}, {"next", Json::array({0, page.next})}, {"more", page.more}};
}

namespace {

const std::vector<std::string> kSpanHead = {"time_utc", "point", "mean",  "min",         "max",
                                            "first",    "last",  "count", "seconds_good"};
const std::vector<std::string> kHead = {"time_utc", "point",        "value",
                                        "quality",  "quality_text", "shown"};

std::string FieldOf(const nlohmann::ordered_json& record, const char* key) {
  const auto found = record.find(key);
  if (found == record.end() || found->is_null()) return {};
  // Tabs and line ends of a text stay, because a CSV cell can contain them.
  return Harmless(found->is_string() ? found->get<std::string>() : found->dump(), "\t\r\n");
}

/// Returns a time in a form that spreadsheets can read: "2026-09-21 14:13:20.000".
std::string CsvTime(const nlohmann::ordered_json& record, const char* key) {
  std::string time = FieldOf(record, key);
  if (time.size() == 24) {
    time[10] = ' ';
    time.pop_back();
  }
  return time;
}

}  // namespace

std::string HistoryCsvHead(bool spans) { return CsvLine(spans ? kSpanHead : kHead); }

std::string GapText(const nlohmann::ordered_json& record) {
  const std::string why = FieldOf(record, "gap");
  const std::string until = FieldOf(record, "until");
  if (why == "clock") return "gap: the clock was set to " + until;
  if (why == "standstill") return "gap: the process or the machine stood still until " + until;
  if (why == "dropped") return "gap: the disk could not be written until " + until;
  if (why == "overwritten") return "gap: the meter has overwritten its values until " + until;
  return "gap: the gateway was down until " + until;
}

std::string EventsCsvHead() {
  static const std::vector<std::string> kEventHead = {"seq",
                                                      "receive_time_utc",
                                                      "device_time_utc",
                                                      "clock_quality",
                                                      "line",
                                                      "device",
                                                      "channel",
                                                      "code",
                                                      "kind",
                                                      "priority",
                                                      "text"};
  return CsvLine(kEventHead);
}

std::string EventsCsvRow(const nlohmann::ordered_json& record) {
  std::vector<std::string> row = {FieldOf(record, "seq"), CsvTime(record, "receive_time"),
                                  CsvTime(record, "device_time")};
  for (const char* key :
       {"clock_quality", "line", "device", "channel", "code", "state", "priority", "text"}) {
    row.push_back(FieldOf(record, key));
  }
  return CsvLine(row);
}

std::string HistoryCsvRow(const nlohmann::ordered_json& record, bool spans) {
  std::vector<std::string> row = {CsvTime(record, "time")};
  const std::vector<std::string>& head = spans ? kSpanHead : kHead;
  for (std::size_t i = 1; i < head.size(); ++i) row.push_back(FieldOf(record, head[i].c_str()));
  if (!spans && record.contains("gap")) row[4] = GapText(record);
  return CsvLine(row);
}

}  // namespace baudgate::status
