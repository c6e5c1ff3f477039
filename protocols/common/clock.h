// Civil time as the clock of a device shows it, and UTC: an offset, and whether the clock follows
// the daylight rule of Europe (an hour more from the last Sunday of March to that of October, both
// at 01:00 UTC). The zone is that of today: what a law was years ago is not known here.
//
//   "+03:00"      2026-07-01T12:00:00 is 09:00:00 UTC
//   "+01:00 eu"   2026-07-01T12:00:00 is 10:00:00 UTC; in January 11:00:00
//                 2026-10-25T02:30:00 comes twice, 2026-03-29T02:30:00 never
//
// ClockCare is a device whose clock the gateway corrects.
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

  /// UTC itself.
  CivilZone() = default;
  /// An error says what may stand there.
  static Result<CivilZone> Parse(std::string_view text);

  enum class Fit : std::uint8_t {
    once,
    twice,  ///< the clock was set back over it: `utc` is the second time, an hour after the first
    never,  ///< the clock was set forward over it: `utc` is as if it had not been
  };
  struct Moment {
    Utc utc{};
    Fit fit = Fit::once;
  };
  Moment ToUtc(Civil civil) const;
  Civil ToCivil(Utc utc) const;
  /// Summer time.
  bool IsDaylight(Utc utc) const;

 private:
  std::chrono::minutes offset_{};  // east of Greenwich, in winter
  bool daylight_ = false;
};

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

}  // namespace baudgate::protocols
