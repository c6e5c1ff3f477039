// Events as a relay prints them, and back: "12.345 0E1/12.410 0E3". What relays really print is
// inferred in part (README.md), so what does not fit is kept as text and never dropped.
//
//   "12.345 0E1"       {channel 0, code 1, 12.345 s of a minute}
//   "12.345 2E17 0.5"  {channel 2, code 17, …, "0.5"}
//   "12.345 0Q1 0.5"   {channel 0, code 0, …, "12.345 0Q1 0.5"}
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "protocols/conversation.h"

namespace baudgate::protocols::spabus {

/// Events that every relay has, whatever its masks say.
inline constexpr std::uint32_t kRestarted = 50;  ///< its clock starts again, its register is empty
inline constexpr std::uint32_t kOverflow = 51;   ///< what came after it is lost

/// L and B.
constexpr bool IsEventList(char category) { return category == 'L' || category == 'B'; }

/// The data of a reply to L or B. Empty data: none.
std::vector<DeviceEvent> ParseEvents(std::string_view data);
/// Whether the data can be that of a reply to L or B, and not of another: empty, or each part a
/// time and a letter with a number behind it.
bool LooksLikeEvents(std::string_view data);
/// `event.time` is of a minute. Without it "00.000".
std::string PrintEvent(const DeviceEvent& event);

}  // namespace baudgate::protocols::spabus
