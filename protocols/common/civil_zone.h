// Civil time as the clock of a device shows it, and UTC: an offset, and whether the clock follows
// the daylight rule of Europe (an hour more from the last Sunday of March to that of October, both
// at 01:00 UTC). The zone is that of today: what a law was years ago is not known here.
//
//   "+03:00"      2026-07-01T12:00:00 is 09:00:00 UTC
//   "+01:00 eu"   2026-07-01T12:00:00 is 10:00:00 UTC; in January 11:00:00
//                 2026-10-25T02:30:00 comes twice, 2026-03-29T02:30:00 never
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>

#include "gateway/base/result.h"

namespace baudgate {

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

}  // namespace baudgate
