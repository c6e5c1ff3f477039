// Civil times as meters write them: BCD second, minute, hour, weekday (1 = Monday), day, month,
// year (reference, 8.1). 31 30 15 01 02 09 02 is 2002-09-02T15:30:31. ClockDrift measures how far a
// meter's clock is off.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/common/clock.h"
#include "protocols/common/decoded.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

inline constexpr std::size_t kCivilSize = 7;

/// Reads kCivilSize bytes. Empty: there is no such moment. The weekday is not looked at.
std::optional<CivilZone::Civil> CivilOf(View bytes);
Bytes BytesOf(CivilZone::Civil civil);

// How far a meter's clock is from this machine's, from its answer to 04 00: what it shows against
// the middle of the time in which it must have looked at it. It shows whole seconds, so half a
// second is added: right to half a second and half the time of the exchange.
//
//   > 05 04 00 63 01     the last byte arrives at 12:00:00.000
//   < 05 30 00 15 …      15:00:30 at +03:00; the first byte comes at 12:00:00.020       +30.49 s

/// Whether the request asks for the meter's clock.
bool AsksClock(View pdu);

class ClockDrift {
 public:
  /// A drift that is older says nothing of now.
  static constexpr Duration kFresh = std::chrono::hours(1);
  /// Wider than this nobody knows when the meter looked at its clock.
  static constexpr Duration kWidest = std::chrono::seconds(1);

  void OnHostClock(bool right) { right_ = right; }
  /// A request for the clock is made: it has not been sent yet.
  void OnAsked() { first_.reset(); }
  /// It is sent, perhaps once more: its last byte arrives then.
  void OnSent(Now arrives, Duration character);

  /// Seconds, positive where the meter is ahead; good while this machine's clock is known to be
  /// right. `data` answers; the reply of `bytes` has come whole at `now`.
  Decoded Of(View data, std::size_t bytes, const Scale& scale, Instant now);
  /// What Of has said last, if that was good and is fresh.
  std::optional<double> Latest(Instant now) const;
  /// The clock is another one now, or another meter's.
  void Forget() { latest_.reset(); }

 private:
  bool right_ = false;
  std::optional<Instant> first_;  // when it was sent first
  Now arrives_{};                 // when it was sent last
  Duration character_{};
  std::optional<double> latest_;
  Instant latest_at_{};
};

/// The PDU of a write that corrects the clock, 03 0B; an error says why it cannot be. A number is
/// seconds, true is the way back of the drift.
Result<Bytes> ClockCorrection(const Value& value, const ClockDrift& drift, Instant now);

}  // namespace baudgate::protocols::set4tm
