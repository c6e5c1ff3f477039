// When was it? A device says part of the time ("12.345" of a minute), the gateway knows when it
// heard of it, and since when the device had nothing to tell. What follows from these, and how sure
// it is; no clock is asked here, and steps of the wall clock between the two change nothing.
//
//   said 59.900, received 10:00:00.300, oldest 1 s   09:59:59.900  device
//   said 59.900, received 10:00:00.300, oldest 5min  09:59:59.900  minute_guessed: or 09:58:59.900
//   … said 30.000, received 10:00:00.300, oldest 1 s   09:59:30.000  out_of_step: it was not then
//   nothing said, received 10:00:00.300              10:00:00.300  none
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "gateway/base/time.h"
#include "protocols/conversation.h"

namespace baudgate::events {

/// Whose clock a time is, and how good. The numbers are users': in the file, in JSON, on Modbus and
/// DDS; new ones are appended.
enum class ClockQuality : std::uint16_t {
  none = 0,            ///< the device has said no time: it is when the gateway heard of it
  gateway = 1,         ///< the gateway's own: it has seen it happen
  device = 2,          ///< the device's, whole, or one minute alone fits
  minute_guessed = 3,  ///< the device's, and of several minutes that fit the last
  out_of_step = 4,     ///< the device's, which no minute brings into step with the gateway's
};
inline constexpr std::size_t kClockQualities = 5;
std::string_view Name(ClockQuality quality);       ///< "minute guessed"
ClockQuality ClockQualityOf(std::int64_t number);  ///< none where there is no such

/// A device's clock may be ahead of the gateway's, or behind it, by so much.
inline constexpr Duration kClockTolerance = std::chrono::seconds(2);

struct PlacedTime {
  WallTime time{};
  ClockQuality quality = ClockQuality::none;
};

/// Times of one batch, in order: an event is no older than the one before it, as far as its clock
/// allows. `oldest`: none happened longer ago; nothing: not known.
std::vector<PlacedTime> Place(const std::vector<std::optional<SaidTime>>& said, WallTime received,
                              std::optional<Duration> oldest);

}  // namespace baudgate::events
