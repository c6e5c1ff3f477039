// The types of time (monotonic and civil), and durations as users write them ("250ms").
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/result.h"

namespace baudgate {

/// Monotonic time, for deadlines and ages. The bus and the protocols read no clock: they get the
/// time as an argument.
using Instant = std::chrono::steady_clock::time_point;
using Duration = std::chrono::nanoseconds;
/// Civil time (UTC), for the time stamps that users see.
using WallTime = std::chrono::sys_time<std::chrono::nanoseconds>;

using namespace std::chrono_literals;  // NOLINT: durations are written 5ms everywhere

/// A moment on both clocks, taken together.
struct Now {
  Instant instant;
  WallTime wall;
};

/// Reads the clocks of this machine. The bus and the protocols must not call it; they get the time
/// as an argument.
Now ReadClocks();

/// Reads "250ms", "1s", "5min", "1.5h", "20us". Refuses negative numbers, and numbers without a
/// unit except 0.
Result<Duration> ParseDuration(std::string_view text);

/// Returns the shortest text that ParseDuration reads back to the same value: "250ms", "1.5s",
/// "1min".
std::string FormatDuration(Duration duration);

/// Returns "2026-11-21T01:14:31.250Z".
std::string FormatWallTime(WallTime time);

inline std::optional<Instant> Soonest(std::initializer_list<std::optional<Instant>> times) {
  std::optional<Instant> soonest;
  for (const std::optional<Instant>& time : times) {
    if (time && (!soonest || *time < *soonest)) soonest = time;
  }
  return soonest;
}

inline bool HasCome(const std::optional<Instant>& time, Instant now) {
  return time && *time <= now;
}

/// Reads a time as FormatWallTime writes it, or a shorter one: "2026-11-21", "2026-11-21T01:14"; a
/// blank may replace the T. The time is always UTC, with or without the Z.
Result<WallTime> ParseWallTime(std::string_view text);

/// Reads a duration before `now` ("2h"), or a time as ParseWallTime does.
Result<WallTime> ParseSince(std::string_view text, WallTime now);

}  // namespace baudgate
