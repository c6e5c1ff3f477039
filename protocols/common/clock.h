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

  /// Constructs the zone UTC, without summer time.
  CivilZone() = default;
  /// Parses "+03:00" or "+01:00 eu". The text of an error lists the allowed forms.
  static Result<CivilZone> Parse(std::string_view text);

  enum class Fit : std::uint8_t {
    once,
    /// The civil time occurs twice, because the clock was set back; `utc` is the second of the two
    /// moments, an hour after the first.
    twice,
    /// The civil time does not occur, because the clock was set forward past it; `utc` is computed
    /// as if the clock had not been set forward.
    never,
  };
  struct Moment {
    Utc utc{};
    Fit fit = Fit::once;
  };
  Moment ToUtc(Civil civil) const;
  Civil ToCivil(Utc utc) const;
  bool IsDaylight(Utc utc) const;

 private:
  // Offset from UTC without summer time; positive: east of Greenwich.
  std::chrono::minutes offset_{};
  bool daylight_ = false;
};

// Settings for a device whose clock the gateway corrects. A protocol that supports corrections has
// these three options, and checks that a device with `correct_clock` has these two points:
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
  Duration least{};  ///< a drift smaller than this is not corrected
  Duration most{};   ///< a drift larger than this is not corrected, only reported
  CivilZone zone;
  std::uint32_t drift = 0;
  std::uint32_t correction = 0;
};

/// Returns the settings for correcting the clock of `device`. Empty: its options request no
/// correction, its time zone is missing, or it lacks the point clock_drift or clock_correction.
std::optional<ClockCare> ClockCareOf(const config::Device& device);

/// True if a device's clock is allowed to be corrected at `now`. A device stores half-hour records
/// and daily readings at fixed times of its clock, so corrections are made only in minutes 5 to 25
/// and 35 to 55, and never between 23:30 and 00:30 of that clock.
bool MayCorrectAt(WallTime now, const CivilZone& zone);

}  // namespace baudgate::protocols
