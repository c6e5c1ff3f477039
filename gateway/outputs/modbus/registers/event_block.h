// The events of a unit as registers, from 9016. Pure; what is shown comes from
// gateway/records/events/event_feed.h, asked by gateway/outputs/modbus/service/event_window.cpp.
//
//   +0 first to show  +2 newest  +4 oldest kept  +6 lost (u32 each)  +8 how many follow  +9 0
//   +10 … seven times: +0 number  +2 seconds since 1970 (u32 each)  +4 milliseconds
//                      +5 clock quality  +6 channel  +7 code (u32)  +9 state
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "gateway/records/events/event_feed.h"

namespace baudgate::modbus {

inline constexpr std::size_t kShownEvents = 7;
inline constexpr std::size_t kEventHead = 10;
inline constexpr std::size_t kEventRecord = 10;

/// Where its values start, closed by its length.
inline constexpr std::array<std::uint16_t, 56> kEventBlockLayout = [] {
  std::array<std::uint16_t, 56> layout{0, 2, 4, 6, 8, 9};
  std::size_t at = 6;
  for (std::size_t event = 0; event < kShownEvents; ++event) {
    for (const std::size_t place : {0U, 2U, 4U, 5U, 6U, 7U, 9U}) {
      layout[at++] = static_cast<std::uint16_t>(kEventHead + event * kEventRecord + place);
    }
  }
  layout[at] = static_cast<std::uint16_t>(kEventHead + kShownEvents * kEventRecord);
  return layout;
}();
static_assert(kEventBlockLayout.back() == 80);
using EventBlock = std::array<std::uint16_t, kEventBlockLayout.back()>;

/// `first`: as the client has written it. Numbers of more than 32 bits show their low ones.
EventBlock EventBlockOf(const events::EventFeed::Shown& shown, std::uint32_t first);

}  // namespace baudgate::modbus
