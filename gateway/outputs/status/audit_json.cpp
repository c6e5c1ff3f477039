// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/audit_json.h"

#include "gateway/base/shown.h"
#include "gateway/outputs/status/files_json.h"
#include "gateway/outputs/status/json_time.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::control {

using Json = nlohmann::ordered_json;

namespace {

Json AdviceOf(const audit::AuditState& state) {
  Json advice = Json::array();
  if (!state.trouble.empty()) {
    std::string text = state.trouble;
    text += state.require ? "; writes to points are refused (audit: require)"
                          : "; writes are sent all the same, their records wait in memory";
    if (state.waiting > 0) text += ", " + Plural(state.waiting, "record");
    advice.push_back(text);
  }
  if (state.lost > 0) {
    advice.push_back(Plural(state.lost, "record") + " of writes lost since the start: there was " +
                     "no room for more while the disk failed");
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

}  // namespace baudgate::control
