// A device whose clock the gateway corrects by itself, because its options say so. A protocol that
// can has these two options in its table, and checks that the device has these two points:
//
//   - name: m1
//     time_zone: "+03:00"
//     correct_clock: 5s                 from so much on; 0s: never
//     correct_clock_most: 60s           beyond that it is only told
//     points:
//       - { name: clock_drift, … }      seconds, positive where the device is ahead
//       - { name: clock_correction, … } true: by the way back of the drift
//
// gateway/daemon/clocks/clock_corrector.h does it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "config/model/device.h"
#include "gateway/base/time.h"
#include "protocols/common/civil_zone.h"

namespace baudgate {

inline constexpr const char* kCorrectClock = "correct_clock";
inline constexpr const char* kCorrectClockMost = "correct_clock_most";
inline constexpr std::string_view kClockDriftPoint = "clock_drift";
inline constexpr std::string_view kClockCorrectionPoint = "clock_correction";

struct ClockCare {
  Duration least{};              ///< a smaller drift is left
  Duration most{};               ///< a larger one, too
  CivilZone zone;                ///< of the device's clock
  std::uint32_t drift = 0;       ///< index of the point
  std::uint32_t correction = 0;  ///< the same
};

/// Empty: it is not wanted, or a point is missing.
std::optional<ClockCare> ClockCareOf(const config::Device& device);

/// Far enough from what the device does at full and half hours (records of half an hour) and at
/// midnight of its clock (readings of the day): minutes 5 to 25 and 35 to 55, and not between 23:30
/// and 00:30.
bool MayCorrectAt(WallTime now, const CivilZone& zone);

}  // namespace baudgate
