// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "gateway/outputs/status/records_json.h"

namespace baudgate::mqtt {
namespace {

using Json = nlohmann::ordered_json;

std::string JsonText(std::string_view text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

void Replace(std::string& text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
}

/// Returns the value as JSON; `null` for NaN and infinities.
std::string ValueText(const Value& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return JsonText(*text);
  const auto* number = std::get_if<double>(&value);
  if (number != nullptr) return std::isfinite(*number) ? fmt::format("{}", *number) : "null";
  return HasValue(value) ? ToText(value) : "null";
}

}  // namespace

Topics::Topics(const config::Config& config)
    : own_(config.mqtt.prefix + "/" + config.name + "/"), pattern_(config.mqtt.topic) {
  filter_is_own_ = pattern_.find("{gateway}") != std::string::npos;
  Replace(pattern_, "{prefix}", config.mqtt.prefix);
  Replace(pattern_, "{gateway}", config.name);
}

std::string Topics::Of(const std::string& line, const std::string& device,
                       const std::string& point) const {
  std::string topic;
  topic.reserve(pattern_.size() + 64);
  for (std::size_t at = 0; at < pattern_.size();) {
    const std::string_view rest = std::string_view(pattern_).substr(at);
    if (rest.front() != '{') {
      topic += rest.front();
      ++at;
      continue;
    }
    topic += rest[1] == 'l' ? line : rest[1] == 'd' ? device : point;
    at += rest.find('}') + 1;
  }
  return topic;
}

std::string Topics::Filter() const {
  std::string filter;
  for (std::size_t begin = 0; begin <= pattern_.size();) {
    const std::size_t end = std::min(pattern_.find('/', begin), pattern_.size());
    const std::string level = pattern_.substr(begin, end - begin);
    filter += (begin == 0 ? "" : "/") + (level.find('{') == std::string::npos ? level : "+");
    begin = end + 1;
  }
  return filter;
}

Reading ReadingOf(const bus::DeviceRecord& record, std::size_t point, Instant now) {
  const bus::PointRecord& its = record.points[point];
  Reading reading{its.value, QualityAt(record, point, now), std::nullopt};
  if (its.read_at) reading.time = its.source_time;
  return reading;
}

std::string_view QualityWord(Quality quality) {
  if (IsGood(quality)) return "good";
  return IsUncertain(quality) ? "uncertain" : "bad";
}

std::string ReasonText(Quality quality) {
  const std::string name = Name(quality);
  const std::size_t colon = name.find(": ");
  return colon == std::string::npos ? std::string() : name.substr(colon + 2);
}

std::string PointPayload(config::Mqtt::Payload payload, const std::string& unit,
                         const Reading& reading, std::int64_t seq) {
  if (payload == config::Mqtt::Payload::value) {
    const auto* text = std::get_if<std::string>(&reading.value);
    const std::string shown = text != nullptr ? *text : ValueText(reading.value);
    return IsGood(reading.quality) && HasValue(reading.value) ? shown : "unavailable";
  }
  return fmt::format(R"({{"value":{},"quality":"{}","reason":"{}","time":{},"unit":{},"seq":{}}})",
                     IsBad(reading.quality) ? "null" : ValueText(reading.value),
                     QualityWord(reading.quality), ReasonText(reading.quality),
                     reading.time ? '"' + FormatWallTime(*reading.time) + '"' : "null",
                     JsonText(unit), seq);
}

std::string EventPayload(const events::EventRecord& record) {
  const Json page = status::PageJson(events::Page{.records = {record}});
  return page["records"][0].dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string AlarmsPayload(std::vector<events::Alarm> alarms) {
  std::ranges::sort(alarms, events::IsWorse);
  if (alarms.size() > kMostAlarms) alarms.resize(kMostAlarms);
  Json list = Json::array();
  for (const events::Alarm& alarm : alarms) list.push_back(status::AlarmJson(alarm));
  return list.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace baudgate::mqtt
