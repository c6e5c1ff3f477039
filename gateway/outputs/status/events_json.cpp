// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/events_json.h"

#include "gateway/base/shown.h"
#include "gateway/outputs/status/files_json.h"
#include "gateway/outputs/status/json_time.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::control {

using Json = nlohmann::ordered_json;

namespace {

Json AdviceOf(const events::EventsState& state) {
  Json advice = Json::array();
  if (!state.trouble.empty()) {
    std::string text = state.trouble + "; devices are not asked for events until it works again";
    if (state.waiting > 0) text += ", and " + Plural(state.waiting, "message") + " of theirs wait";
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
  return json;
}

Json PageJson(const events::Page& page) {
  Json records = Json::array();
  for (const events::EventRecord& record : page.records) records.push_back(RecordJson(record));
  return {{"records", std::move(records)}, {"next", page.next}, {"more", page.more}};
}

}  // namespace baudgate::control
