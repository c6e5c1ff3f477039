// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/value_json.h"

#include <set>

#include "gateway/base/text.h"

namespace baudgate::status {

using Json = nlohmann::ordered_json;

Result<Json> ParseJson(const std::string& text) {
  std::vector<std::set<std::string>> names;
  std::string twice;
  const auto look = [&](int, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) names.emplace_back();
    if (event == Json::parse_event_t::object_end) names.pop_back();
    if (event != Json::parse_event_t::key) return true;
    const auto name = parsed.get<std::string>();
    if (!names.back().insert(name).second) twice = name;
    return true;
  };
  Json json = Json::parse(text, look, false);
  if (!twice.empty()) return Error{"the member " + Quoted(twice) + " occurs twice"};
  return json;
}

Json JsonOf(const bus::LineShares& shares, Now /*now*/) {
  Json json;
  for (std::size_t i = 0; i < bus::kLineUses; ++i) {
    json[std::string(bus::Name(static_cast<bus::LineUse>(i)))] = shares[i];
  }
  return json;
}

Json JsonOf(const bus::RecentOutcomes& recent, Now /*now*/) {
  Json json = {{"exchanges", recent.size()}};
  for (std::size_t i = 1; i < kOutcomeCount; ++i) {
    const auto outcome = static_cast<Outcome>(i);
    json[std::string(Name(outcome))] = recent.Count(outcome);
  }
  return json;
}

Json JsonOf(const bus::Findings& findings, Now /*now*/) {
  Json json = Json::object();
  for (std::size_t i = 0; i < kSymptoms; ++i) {
    const auto symptom = static_cast<Symptom>(i);
    const std::size_t count = findings.Count(symptom);
    if (count > 0) json[std::string(Name(symptom))] = count;
  }
  return json;
}

Json JsonOf(const bus::RoundTrips& trips, Now /*now*/) {
  Json json;
  json["count"] = trips.count();
  json["last_us"] = trips.last() / 1us;
  json["mean_us"] = trips.mean() / 1us;
  json["p50_us"] = trips.Percentile(0.5) / 1us;
  json["p99_us"] = trips.Percentile(0.99) / 1us;
  Json& histogram = json["histogram"] = Json::array();
  for (std::size_t bucket = 0; bucket < bus::RoundTrips::kBuckets; ++bucket) {
    const std::uint64_t count = trips.buckets()[bucket];
    if (count == 0) continue;
    histogram.push_back({{"up_to_us", bus::RoundTrips::UpperEdge(bucket) / 1us}, {"count", count}});
  }
  return json;
}

Json JsonOf(const bus::LastHour& last, Now now) {
  const bus::MinuteCounts hour = last.Sum(now.instant);
  Json json;
  AddFields(hour, now, json);
  json["availability"] = Availability(hour);
  Json& minutes = json["minutes"] = Json::array();
  for (const bus::MinuteCounts& minute : last.All(now.instant)) {
    const bool asked = minute.up + minute.down > Duration::zero();
    minutes.push_back(asked ? Json(std::round(Availability(minute) * 100) / 100) : Json(nullptr));
  }
  return json;
}

Json JsonOf(const config::Timing& timing, Now /*now*/) {
  Json times = Json::array();
  for (std::size_t i = 0; i < config::kNamedTimes.size(); ++i) {
    const auto& [name, time] = config::kNamedTimes[i];
    if (!(timing.*time)) continue;
    times.push_back({{"name", name},
                     {"ms", std::chrono::duration<double, std::milli>(*(timing.*time)).count()},
                     {"from", config::Name(timing.from[i])}});
  }
  return times;
}

Json JsonOf(const bus::WriteCounts& writes, Now /*now*/) {
  Json json;
  for (std::size_t i = 0; i < kWriteEnds; ++i) {
    json[Name(static_cast<WriteEnd>(i))] = writes.ends[i];
  }
  json["not_read_back"] = writes.not_read_back;
  return json;
}

}  // namespace baudgate::status
