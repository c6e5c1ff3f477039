// `CivilZone` converts between UTC and the civil time that a device's clock shows. A zone is an
// offset, and whether the clock follows European summer time (one hour more from the last Sunday of
// March to the last Sunday of October, both at 01:00 UTC). Today's rules apply to all years.
//
//   "+03:00"      2026-07-01T12:00:00 is 09:00:00 UTC
//   "+01:00 eu"   2026-07-01T12:00:00 is 10:00:00 UTC; in January 11:00:00
//                 2026-10-25T02:30:00 occurs twice, 2026-03-29T02:30:00 never
//
// ClockCare has the settings for a device whose clock the gateway corrects.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

#include "config/model/device.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::protocols {

class CivilZone {
 public:
  using Civil = std::chrono::local_seconds;
  using Utc = std::chrono::sys_seconds;

  /// UTC without summer time.
  CivilZone() = default;
  /// Parses "+03:00" or "+01:00 eu". The error names the allowed forms.
  static Result<CivilZone> Parse(std::string_view text);

  enum class Fit : std::uint8_t {
    once,
    twice,  ///< the civil time occurs twice, as the clock was set back; `utc` is the second, an
            ///< hour later
    never,  ///< the clock was set forward past this time; `utc` assumes that it was not
  };
  struct Moment {
    Utc utc{};
    Fit fit = Fit::once;
  };
  Moment ToUtc(Civil civil) const;
  Civil ToCivil(Utc utc) const;
  bool IsDaylight(Utc utc) const;

 private:
  std::chrono::minutes offset_{};  // east of Greenwich, in winter
  bool daylight_ = false;
};

// Settings for a device whose clock the gateway corrects, if the device's options request this. A
// protocol that supports it has these two options and checks that the device has these two points:
//
//   - name: m1
//     time_zone: "+03:00"
//     correct_clock: 5s                 correct a drift from 5 s on; 0s: never
//     correct_clock_most: 60s           a larger drift is only reported
//     points:
//       - { name: clock_drift, … }      seconds, positive if the device is ahead
//       - { name: clock_correction, … } writing true moves the clock back by the drift
//
// gateway/daemon/clocks/clock_corrector.h makes the corrections.

inline constexpr const char* kCorrectClock = "correct_clock";
inline constexpr const char* kCorrectClockMost = "correct_clock_most";
inline constexpr std::string_view kClockDriftPoint = "clock_drift";
inline constexpr std::string_view kClockCorrectionPoint = "clock_correction";

struct ClockCare {
  Duration least{};              ///< a smaller drift is not corrected
  Duration most{};               ///< a larger drift is not corrected either
  CivilZone zone;                ///< of the device's clock
  std::uint32_t drift = 0;       ///< index of the point clock_drift
  std::uint32_t correction = 0;  ///< index of the point clock_correction
};

/// Empty: no correction is configured, or a point is missing.
std::optional<ClockCare> ClockCareOf(const config::Device& device);

/// True if `now` is far enough from a device's own work at full and half hours (half-hour records)
/// and at midnight of its clock (daily readings): minutes 5 to 25 and 35 to 55, and not between
/// 23:30 and 00:30.
bool MayCorrectAt(WallTime now, const CivilZone& zone);

}  // namespace baudgate::protocols
