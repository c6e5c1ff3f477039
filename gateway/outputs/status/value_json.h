// `ValueJson` and `TimeJson` convert values and times to JSON for the answers of the control
// socket. AddFields adds the members of a struct that have a row in its VisitFields
// (gateway/bus/points/counted.h) to an object, and LabelsJson returns the labels of these rows.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/device_status.h"
#include "gateway/bus/points/line_status.h"

namespace baudgate::status {

/// Parses a text from outside as JSON. An error: a member of an object occurs twice, so its reader
/// and its author could mean different values. A text that is no JSON gives a discarded value.
Result<nlohmann::ordered_json> ParseJson(const std::string& text);

/// Returns the time as ISO 8601 in UTC; null for the epoch, which means "not yet".
inline nlohmann::ordered_json TimeJson(WallTime time) {
  using Json = nlohmann::ordered_json;
  return time == WallTime{} ? Json(nullptr) : Json(FormatWallTime(time));
}

/// Returns the milliseconds since `time`; null for the epoch, which means "not yet".
inline nlohmann::ordered_json AgeJson(WallTime time, WallTime now) {
  using Json = nlohmann::ordered_json;
  return time == WallTime{} ? Json(nullptr) : Json((now - time) / 1ms);
}

/// Returns the value; null if there is no value, for NaN and infinities.
inline nlohmann::ordered_json ValueJson(const Value& value) {
  using Json = nlohmann::ordered_json;
  if (const auto* flag = std::get_if<bool>(&value)) return *flag;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return *whole;
  if (const auto* counter = std::get_if<std::uint64_t>(&value)) return *counter;
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  const auto* number = std::get_if<double>(&value);
  return number != nullptr && std::isfinite(*number) ? Json(*number) : Json(nullptr);
}

/// Returns the name of the quality for people; "write only" for a point that is never read.
inline std::string QualityText(const config::Point& point, Quality quality) {
  return point.access == config::Access::write ? "write only" : Name(quality);
}

// JsonOf converts a member whose JSON is an object or an array.

nlohmann::ordered_json JsonOf(const bus::LineShares& shares, Now now);
nlohmann::ordered_json JsonOf(const bus::RecentOutcomes& recent, Now now);
/// Returns the number of each symptom of exchanges on the wire; symptoms with 0 are left out.
nlohmann::ordered_json JsonOf(const bus::Findings& findings, Now now);
nlohmann::ordered_json JsonOf(const bus::RoundTrips& trips, Now now);
/// Returns the last hour. `minutes`: for each minute, the share of exchanges in which the device
/// answered; null: no request was sent.
nlohmann::ordered_json JsonOf(const bus::LastHour& hour, Now now);
nlohmann::ordered_json JsonOf(const config::Timing& timing, Now now);
/// Returns {"ok":12,…,"not_read_back":1}
nlohmann::ordered_json JsonOf(const bus::WriteCounts& writes, Now now);
/// Returns {"ok":447,"no_reply":88,…}
template <std::integral Count>
nlohmann::ordered_json JsonOf(const std::array<Count, kOutcomeCount>& counts, Now /*now*/) {
  nlohmann::ordered_json json;
  for (std::size_t i = 1; i < kOutcomeCount; ++i) {
    json[std::string(Name(static_cast<Outcome>(i)))] = counts[i];
  }
  return json;
}

/// Converts a member to the value of `key`. The suffix of `key` (_us, _ms) is the unit of a
/// duration; an Instant is converted to its age in ms.
template <typename T>
nlohmann::ordered_json FieldJson(std::string_view key, const T& value, Now now) {
  using Json = nlohmann::ordered_json;
  if constexpr (std::is_same_v<T, Duration>) {
    return key.ends_with("_us") ? value / 1us : value / 1ms;
  } else if constexpr (std::is_same_v<T, WallTime>) {
    return key.ends_with("_ms") ? AgeJson(value, now.wall) : TimeJson(value);
  } else if constexpr (std::is_same_v<T, Instant>) {
    return (now.instant - value) / 1ms;
  } else if constexpr (requires { value.has_value(); }) {
    return value ? FieldJson(key, *value, now) : Json(nullptr);
  } else if constexpr (std::is_enum_v<T>) {
    return Name(value);
  } else if constexpr (requires { JsonOf(value, now); }) {
    return JsonOf(value, now);
  } else {
    return value;
  }
}

template <config::HasFields T>
void AddFields(const T& its, Now now, nlohmann::ordered_json& json) {
  VisitFields(&its, [&](auto row) {
    if constexpr (row.in_json) {
      json[std::string(row.key)] = FieldJson(row.key, std::invoke(row.member, its), now);
    }
  });
}

/// Returns {"retries":"retries","missed":"missed periods",…}: the labels of the rows of T's
/// VisitFields (gateway/bus/points/counted.h), in the order in which they are shown.
template <config::HasFields T>
nlohmann::ordered_json LabelsJson() {
  struct Labelled {
    int place;
    std::string_view key, label;
  };
  std::vector<Labelled> rows;
  VisitFields(static_cast<const T*>(nullptr), [&](auto row) {
    if constexpr (row.in_json) {
      if (!row.label.empty()) rows.push_back({row.place, row.key, row.label});
    }
  });
  std::ranges::stable_sort(rows, {}, &Labelled::place);
  nlohmann::ordered_json json;
  for (const Labelled& row : rows) json[std::string(row.key)] = row.label;
  return json;
}

}  // namespace baudgate::status
