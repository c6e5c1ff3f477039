// `JsonLine` and `PlainLine` make the line that `watch` prints for a sample of a point.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/outputs/dds/published_types.h"

namespace baudgate::tools {

// `JsonOf` makes JSON of a sample: the fields of its published type
// (gateway/outputs/dds/published_types.h), with their names and in their order.
//
//   source_time_ns 1790000000000000000    "source_time":"2026-09-21T14:13:20.000Z"
//   source_time_ns 0                      "source_time":null
//   value NaN                             "value":null

using Json = nlohmann::ordered_json;

inline std::string Dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

template <typename Value>
void PutField(std::string_view name, const Value& value, Json& to) {
  constexpr std::string_view kTime = "_time_ns";
  constexpr std::string_view kUnit = "_ns";
  if constexpr (std::same_as<Value, std::int64_t>) {
    if (name.ends_with(kTime)) {
      Json& made = to[std::string(name.substr(0, name.size() - kUnit.size()))];
      if (value > 0) made = FormatWallTime(WallTime(Duration(value)));
      return;
    }
  }
  Json& made = to[std::string(name)];
  if constexpr (std::same_as<Value, double>) {
    if (!std::isfinite(value)) return;
  }
  made = value;
}

/// `special` is called with the name of each field. It returns true if it has added the field
/// itself.
template <typename Sample, typename Special>
Json JsonOf(const Sample& sample, const Special& special) {
  Json json;
  dds::ForEachField<Sample>([&](const auto& field) {
    if (!special(field.name, json)) PutField(field.name, sample.*field.member, json);
  });
  return json;
}
template <typename Sample>
Json JsonOf(const Sample& sample) {
  return JsonOf(sample, [](std::string_view, Json&) { return false; });
}

template <typename Sample>
Json KeyOf(const Sample& sample) {
  Json json;
  dds::ForEachField<Sample>([&](const auto& field) {
    if (field.key) PutField(field.name, sample.*field.member, json);
  });
  return json;
}

/// A sample of a point, or the end of the point. At the end, only the key fields of the sample are
/// valid.
struct PointEvent {
  dds::PointSample sample;
  dds::Origin origin;
  std::optional<dds::Gone> gone;
};

WallTime SourceTime(const dds::PointSample& sample);
Quality QualityOf(const dds::PointSample& sample);
std::string ValueText(const dds::PointSample& sample);

/// True if `now` is the reading of `before` again, sent by the heartbeat.
bool IsSameReading(const PointEvent& before, const PointEvent& now);
/// True if value, unit and quality are equal, and the point has ended in both events or in neither.
bool LooksAlike(const PointEvent& before, const PointEvent& now);

std::string JsonLine(const PointEvent& event);
std::string PlainLine(const PointEvent& event);

}  // namespace baudgate::tools
