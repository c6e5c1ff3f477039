// Values in the answers of the control socket. TimeJson writes times.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate::control {

// Civil times in the answers of the control socket.

/// ISO 8601 in UTC; the epoch stands for "not yet" and becomes null.
inline nlohmann::ordered_json TimeJson(WallTime time) {
  using Json = nlohmann::ordered_json;
  return time == WallTime{} ? Json(nullptr) : Json(FormatWallTime(time));
}

/// Milliseconds since then; null: not yet.
inline nlohmann::ordered_json AgeJson(WallTime time, WallTime now) {
  using Json = nlohmann::ordered_json;
  return time == WallTime{} ? Json(nullptr) : Json((now - time) / 1ms);
}

/// Nothing, and what is no number, is null.
inline nlohmann::ordered_json ValueJson(const Value& value) {
  using Json = nlohmann::ordered_json;
  if (const auto* flag = std::get_if<bool>(&value)) return *flag;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return *whole;
  if (const auto* counter = std::get_if<std::uint64_t>(&value)) return *counter;
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  const auto* number = std::get_if<double>(&value);
  return number != nullptr && std::isfinite(*number) ? Json(*number) : Json(nullptr);
}

}  // namespace baudgate::control
