// The named times of a line and of its devices (docs/timeouts.md), and where each comes from.
// Recheck says when a reading is asked for a second time.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
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

std::string_view Name(Recheck recheck);

/// No line is faster: a request and its reply at 115200 bit/s, and what a USB adapter adds.
inline constexpr Duration kShortestPoll = std::chrono::milliseconds(5);

/// The sources of times: a later one here takes precedence.
/// `learned`: it is what the device itself says that it needs.
enum class Level : std::uint8_t { protocol, gateway, line, profile, device, learned };

/// The named times of a line (docs/timeouts.md). Nothing = decided one level up.
struct Timing {
  std::optional<Duration> quiet;    ///< silence before sending
  std::optional<Duration> reply;    ///< end of request to first byte of the reply
  std::optional<Duration> gap;      ///< longest silence inside a frame
  std::optional<Duration> ceiling;  ///< whole exchange, from the end of the request
  std::optional<Duration> drain;    ///< silence that ends a drain
  /// The source of each, in the order of kNamedTimes.
  std::array<Level, 5> from{};

  bool operator==(const Timing&) const = default;
};

/// Where one of `least` is longer than in `timing`, it counts.
Timing Lengthen(const Timing& timing, const Timing& least);

struct NamedTime {
  std::string_view name;
  std::optional<Duration> Timing::*time = nullptr;
};
inline constexpr std::array<NamedTime, 5> kNamedTimes = {{{"quiet", &Timing::quiet},
                                                          {"reply", &Timing::reply},
                                                          {"gap", &Timing::gap},
                                                          {"ceiling", &Timing::ceiling},
                                                          {"drain", &Timing::drain}}};

std::string_view Name(Level level);  ///< "protocol", "gateway", …

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
  visit(Field<&Pace::timing>());
  visit(Field<&Pace::retries>());
  visit(Field<&Pace::poll>());
  visit(Field<&Pace::slow>());
  visit(Field<&Pace::recheck>());
  visit(Field<&Pace::daily>());
}

/// Key by key: `first` wins where it says something, else `second`.
Pace Merge(const Pace& first, const Pace& second);

}  // namespace baudgate::config
