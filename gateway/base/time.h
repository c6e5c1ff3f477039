// The two kinds of time, and durations as users write them ("250ms").
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/result.h"

namespace baudgate {

/// Monotonic: deadlines, ages. Below the composition root it is always an argument, never asked
/// for.
using Instant = std::chrono::steady_clock::time_point;
using Duration = std::chrono::nanoseconds;
/// Civil time: only what users read as a time stamp.
using WallTime = std::chrono::sys_time<std::chrono::nanoseconds>;

using namespace std::chrono_literals;  // NOLINT: durations are written 5ms everywhere

/// A moment on both clocks, taken together.
struct Now {
  Instant instant;
  WallTime wall;
};

/// The clocks of this machine; called by the composition root and the loop drivers only.
Now ReadClocks();

/// "250ms", "1s", "5min", "1.5h", "20us". A number without a unit is an error, and so are negative
/// ones.
Result<Duration> ParseDuration(std::string_view text);

/// The shortest form that ParseDuration reads back to the same value: "250ms", "1.5s", "1min".
std::string FormatDuration(Duration duration);

/// "2026-11-21T01:14:31.250Z".
std::string FormatWallTime(WallTime time);

// Times at which something is due, where one may never be.

/// Empty: none of them is ever due.
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

// Times and spans as users give them to ask for what has been: `--since 2h`.

/// What FormatWallTime writes, or less of it: "2026-11-21", "2026-11-21T01:14", with a blank for
/// the T. Always UTC, with the Z or without.
Result<WallTime> ParseWallTime(std::string_view text);

/// "2h" before `now`, or a time.
Result<WallTime> ParseSince(std::string_view text, WallTime now);

}  // namespace baudgate
