// Civil times in the answers of the control socket.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "gateway/base/time.h"

namespace baudgate::control {

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

}  // namespace baudgate::control
