// What stands in the history of a point: from this time on it had this value and this quality.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/quality.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate::history {

/// Milliseconds since 1970, UTC: the grain of all times in the history.
using Millis = std::int64_t;

inline Millis ToMillis(WallTime time) {
  return std::chrono::floor<std::chrono::milliseconds>(time).time_since_epoch().count();
}
inline WallTime ToWall(Millis time) { return WallTime(std::chrono::milliseconds(time)); }

inline constexpr Millis kSecond = 1000;
inline constexpr Millis kMinute = 60 * kSecond;
inline constexpr Millis kHour = 60 * kMinute;
inline constexpr Millis kDay = 24 * kHour;

/// The begin of the span of that width in which `time` lies; all spans count from 1970.
constexpr Millis FloorTo(Millis time, Millis width) {
  const Millis rest = time % width;
  return time - (rest < 0 ? rest + width : rest);
}

struct Entry {
  Millis time = 0;
  Value value{};  ///< empty: under a bad quality, or no number
  Quality quality = Quality::bad_waiting;

  bool operator==(const Entry&) const = default;
};

}  // namespace baudgate::history
