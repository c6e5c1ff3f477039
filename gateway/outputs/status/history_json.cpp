// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/history_json.h"

#include "gateway/base/shown.h"
#include "gateway/outputs/status/files_json.h"
#include "gateway/outputs/status/json_time.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::control {

using Json = nlohmann::ordered_json;

namespace {

Json AdviceOf(const history::HistoryState& state) {
  Json advice = Json::array();
  if (!state.trouble.empty()) {
    advice.push_back(state.trouble +
                     "; values wait, and are dropped when there is no room for more");
  }
  for (const std::string& text : state.unread) {
    advice.push_back(text + "; its values are missing in answers until it is mended or moved away");
  }
  const std::string aside = PutAsideAdvice(state.folder, state.put_aside);
  if (!aside.empty()) advice.push_back(aside);
  if (state.counters.dropped > 0) {
    advice.push_back(Plural(state.counters.dropped, "value") +
                     " were dropped since the start, because the disk did not take them; the "
                     "history has a gap there");
  }
  return advice;
}

/// As in the contract: what nobody knows has neither value nor quality.
Json RecordJson(const history::HistoryRecord& record, const std::string& point) {
  Json json = {{"time", FormatWallTime(history::ToWall(record.entry.time))}, {"point", point}};
  if (record.gap) {
    json["value"] = nullptr;
    json["quality"] = nullptr;
    json["gap"] = Name(record.gap->why);
    json["until"] = FormatWallTime(history::ToWall(record.gap->until));
    return json;
  }
  json["value"] = ValueJson(record.entry.value);
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

Json PageJson(const history::Page& page, const std::string& point) {
  Json records = Json::array();
  for (const history::HistoryRecord& record : page.records) {
    records.push_back(RecordJson(record, point));
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

}  // namespace baudgate::control
