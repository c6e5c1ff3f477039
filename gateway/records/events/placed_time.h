// The time of an event. A device reports part of it ("12.345" of a minute); the gateway knows when
// it received the event, and since when the device had no other. From these follow the time and how
// sure it is. No clock is read here, and steps of the wall clock in between change nothing.
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

/// The clock of a time, and how good it is. The numbers are public: in the file, in JSON, on Modbus
/// and DDS; new ones are appended.
enum class ClockQuality : std::uint16_t {
  none = 0,            ///< the device reported no time: it is when the gateway received it
  gateway = 1,         ///< the gateway's own
  device = 2,          ///< the device's; whole, or only one minute fits
  minute_guessed = 3,  ///< the device's; the last of several minutes that fit
  out_of_step = 4,     ///< the device's; no minute agrees with the gateway's clock
};
inline constexpr std::size_t kClockQualities = 5;
std::string_view Name(ClockQuality quality);       ///< "minute guessed"
ClockQuality ClockQualityOf(std::int64_t number);  ///< none where there is no such

/// A device's clock may be this far ahead of the gateway's, or behind it.
inline constexpr Duration kClockTolerance = std::chrono::seconds(2);

struct PlacedTime {
  WallTime time{};
  ClockQuality quality = ClockQuality::none;
};

/// The times of one batch, in order: an event is no older than the one before it, as far as its
/// clock allows. `oldest`: no event is older; empty: not known.
std::vector<PlacedTime> Place(const std::vector<std::optional<SaidTime>>& said, WallTime received,
                              std::optional<Duration> oldest);

}  // namespace baudgate::events
