// The codes of the gateway's own events. The numbers are public (docs/events.md): new ones are
// appended, none is used again. Devices do not have such codes: a table of a profile ends at
// 999999.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace baudgate::events {

enum class OwnCode : std::uint32_t {
  started = 1'000'001,
  stops = 1'000'002,
  left_out = 1'000'003,      ///< events of one kind that came too often
  disk_trouble = 1'000'004,  ///< of events.db, reported when it is over
  port_down = 1'000'005,     ///< of a line
  port_lent = 1'000'006,
  collisions = 1'000'007,
  ring_open = 1'000'008,
  no_answer = 1'000'009,  ///< of a device
  not_in_use = 1'000'010,
  wrong_device = 1'000'011,
  replaced = 1'000'012,
  point_change = 1'000'013,  ///< of a point, in `text`
  point_above = 1'000'014,
  point_below = 1'000'015,
  acknowledged = 1'000'016,  ///< an alarm
  not_watched = 1'000'017,   ///< an alarm that the configuration no longer has
  reloaded = 1'000'018,
  taken_back = 1'000'019,       ///< a configuration that was not confirmed
  clock_corrected = 1'000'020,  ///< of a device
  clock_left = 1'000'021,       ///< of a device: it should have been corrected, and was not
  own_alarm = 1'000'022,        ///< of a line, a device, a route or a disk
  port_served = 1'000'023,      ///< of a line that is not polled: a client has its port
  priority = 1'000'024,         ///< of an active alarm: the configuration has changed it
};

constexpr std::uint32_t CodeOf(OwnCode code) { return static_cast<std::uint32_t>(code); }

}  // namespace baudgate::events
