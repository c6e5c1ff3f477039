// The named times of a line and of its devices (docs/timeouts.md), and where each comes from.
// Recheck says when a reading is asked for a second time.
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

// When a reading is asked for a second time before it counts (docs/timeouts.md).
enum class Recheck : std::uint8_t {
  off,
  jump,   ///< when it differs from the last by more than the point's jump
  always  ///< each time
};

/// No line is faster: a request and its reply at 115200 bit/s, and what a USB adapter adds.
inline constexpr Duration kShortestPoll = std::chrono::milliseconds(5);

/// The sources of times: a later one here takes precedence.
/// `learned`: it is what the device itself says that it needs.
enum class Level : std::uint8_t { protocol, gateway, line, profile, device, learned };

/// The named times of a line (docs/timeouts.md). Nothing = decided one level up.
struct Timing {
  std::optional<Duration> quiet;
  std::optional<Duration> reply;
  std::optional<Duration> gap;
  std::optional<Duration> ceiling;
  std::optional<Duration> drain;
  /// The source of each, in the order of kNamedTimes.
  std::array<Level, 5> from{};

  bool operator==(const Timing&) const = default;
};

/// Where one of `least` is longer than in `timing`, it counts.
Timing Lengthen(const Timing& timing, const Timing& least);

template <typename Visit>
constexpr void VisitFields(const Timing*, Visit visit) {
  // Only the quiet time may be nothing: a waiting time of 0 would mean "never" or "for ever".
  visit(Field<&Timing::quiet>{"quiet", "silence before a request", 0ms, 1min});
  visit(Field<&Timing::reply>{"reply", "from the end of the request to the first byte of the reply",
                              1ms, 10min});
  visit(Field<&Timing::gap>{"gap", "longest silence inside a frame", 1ms, 1min});
  visit(Field<&Timing::ceiling>{"ceiling", "whole exchange, from the end of the request", 1ms,
                                10min});
  visit(Field<&Timing::drain>{"drain", "silence that ends a drain", 1ms, 1min});
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

/// "quiet 5ms, reply 1s (line), …": of times that are all given; the protocol's own stand without
/// a word.
std::string TimesText(const Timing& timing);

/// `first` wins where it says something, else `second`.
Timing Merge(const Timing& first, const Timing& second);

/// What device and profile say, in this order; but where the device says nothing, of reply, gap and
/// ceiling the longer one of profile and line counts: the line's author knows its serial
/// server.
Timing MergeDevice(const Timing& device, const Timing& profile, const Timing& line);

/// What a device is really timed with: `given` over `fallback`, which has every field. Who allows
/// more time to begin a reply, or for pauses in it, but does not say how long the whole exchange
/// may take, lengthens that alike; and it is never shorter than reply and gap.
Timing Resolve(const Timing& given, const Timing& fallback);

/// What gateway, line, profile and device may each say about asking. Nothing = decided one level
/// up.
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
  visit(Field<&Pace::poll>{"poll", "period of the points of group fast", kShortestPoll, 24h});
  visit(Field<&Pace::slow>{"slow", "period of the points of group slow", kShortestPoll, 24h});
  visit(Field<&Pace::daily>{"daily", "period of the points of group daily", 1min, 7 * 24h});
  visit(Field<&Pace::retries>{
      "retries", "how often a failed exchange is repeated before its poll is given up", 0, 10});
  visit(Field<&Pace::recheck>{
      .help = "which readings wait for a second one: none, those that differ by more than the "
              "point's jump, all",
      .fallback = "jump where nothing but an 8-bit sum or no sum guards replies and parity is off, "
                  "else off"});
  visit(Field<&Pace::timing>{.help = "a map of named times, below"});
}

/// Key by key: `first` wins where it says something, else `second`.
Pace Merge(const Pace& first, const Pace& second);

}  // namespace baudgate::config
