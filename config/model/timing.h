// `Timing` contains the named times of a line and its devices (docs/timeouts.md), and the source of
// each time. Recheck selects the readings that need a second reading.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "config/model/fields.h"
#include "gateway/base/time.h"

namespace baudgate::config {

// Recheck selects the readings that count only after a second reading (docs/timeouts.md).
enum class Recheck : std::uint8_t {
  off,
  /// Readings count after a second reading if they differ from the previous reading by more than
  /// the point's jump.
  jump,
  always
};

/// The shortest poll period that can be configured: a request and its reply take about this time at
/// 115200 bit/s through a USB adapter.
inline constexpr Duration kShortestPoll = std::chrono::milliseconds(5);

/// The sources of times; a later one takes precedence. `learned`: the device itself has reported
/// that it needs this time.
enum class Level : std::uint8_t { protocol, gateway, line, profile, device, learned };

/// The named times of a line (docs/timeouts.md). A time without a value comes from the Level
/// before.
struct Timing {
  std::optional<Duration> quiet;
  std::optional<Duration> reply;
  std::optional<Duration> gap;
  std::optional<Duration> ceiling;
  std::optional<Duration> drain;
  /// The source of each time, in the order of kNamedTimes.
  std::array<Level, 5> from{};

  bool operator==(const Timing&) const = default;
};

/// Returns `timing` with each time that is shorter than in `least` replaced by the time of `least`.
/// A longer reply time lengthens the ceiling by the same amount.
Timing Lengthen(const Timing& timing, const Timing& least);

template <typename Visit>
constexpr void VisitFields(const Timing*, Visit visit) {
  // Only `quiet` can be zero. The other times are waiting times, and 0 would mean "never" or "for
  // ever".
  visit(Field<&Timing::quiet>{"quiet", "least silence before a request", 0ms, 1min});
  visit(Field<&Timing::reply>{
      "reply", "timeout from the end of the request to the first byte of the reply", 1ms, 10min});
  visit(Field<&Timing::gap>{"gap", "longest silence inside a frame", 1ms, 1min});
  visit(Field<&Timing::ceiling>{
      "ceiling", "timeout of the whole exchange, from the end of the request", 1ms, 10min});
  visit(Field<&Timing::drain>{
      "drain",
      "after a failed exchange, bytes are discarded until the line is silent for this time", 1ms,
      1min});
  visit(Field<&Timing::from>());
}

struct NamedTime {
  std::string_view name;
  std::optional<Duration> Timing::*time = nullptr;
};
inline constexpr std::array<NamedTime, 5> kNamedTimes = [] {
  std::array<NamedTime, 5> times;
  VisitFields(static_cast<const Timing*>(nullptr), [&, i = std::size_t{0}](auto field) mutable {
    if constexpr (requires { times[i].time = field.member; })
      times[i++] = {field.key, field.member};
  });
  return times;
}();

/// Returns "quiet 5ms, reply 1s (line), …". All times must be present; times of the protocol have
/// no source in brackets.
std::string TimesText(const Timing& timing);

/// Returns each time of `first` if it is present, else the time of `second`.
Timing Merge(const Timing& first, const Timing& second);

/// Like Merge for device, profile and line, in this order, with an exception: if the device sets no
/// reply, gap or ceiling, the longer time of profile and line applies, because the line's time
/// accounts for its serial server.
Timing MergeDevice(const Timing& device, const Timing& profile, const Timing& line);

/// Returns the times in use: the times of `given`, else of `fallback`, which has all times. If
/// `given` has no ceiling, a given reply time changes the ceiling by the difference to the reply
/// time of `fallback`, and a longer gap lengthens it. The ceiling is never shorter than reply and
/// gap together.
Timing Resolve(const Timing& given, const Timing& fallback);

/// The settings for polling that gateway, line, profile and device can have. A setting without a
/// value comes from the Level before.
struct Pace {
  Timing timing;
  std::optional<int> retries;
  std::optional<Duration> poll;
  std::optional<Duration> slow;
  std::optional<Recheck> recheck;
  std::optional<Duration> daily;
};

template <typename Visit>
void VisitFields(const Pace*, Visit visit) {
  visit(Field<&Pace::poll>{"poll", "time from one poll of the group fast to the next",
                           kShortestPoll, 24h});
  visit(Field<&Pace::slow>{"slow", "time from one poll of the group slow to the next",
                           kShortestPoll, 24h});
  visit(Field<&Pace::daily>{"daily", "time from one poll of the group daily to the next", 1min,
                            7 * 24h});
  visit(Field<&Pace::retries>{
      "retries", "how often a failed exchange is repeated before its poll is given up", 0, 10});
  visit(Field<&Pace::recheck>{
      .help = "which values are read twice: none (off), those that differ by more than the point's "
              "jump (jump), all (always)",
      .fallback = "jump if the line has no parity, and replies have no checksum or an 8-bit sum; "
                  "else off"});
  visit(Field<&Pace::timing>{.help = "a map of named times, below"});
}

Pace Merge(const Pace& first, const Pace& second);

}  // namespace baudgate::config
