// Values in the answers of the control socket.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

#include "gateway/base/value.h"

namespace baudgate::control {

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
