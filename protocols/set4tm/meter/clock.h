// Civil times as meters send them: BCD second, minute, hour, weekday (1 = Monday), day, month, year
// (reference, 8.1). Example: 31 30 15 01 02 09 02 is 2002-09-02T15:30:31. ClockDrift measures a
// clock's error.
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/common/clock.h"
#include "protocols/common/decoded.h"
#include "protocols/set4tm/meter/constants.h"

namespace baudgate::protocols::set4tm {

inline constexpr std::size_t kCivilSize = 7;

/// Converts the kCivilSize bytes of a time. Empty: the time is impossible. The weekday is ignored.
std::optional<CivilZone::Civil> CivilOf(View bytes);
Bytes BytesOf(CivilZone::Civil civil);

// ClockDrift measures the difference between a meter's clock and this machine's clock from the
// reply to 04 00. It compares the meter's time with the middle of the interval in which the meter
// must have read its clock. The meter sends whole seconds, so half a second is added: the error is
// up to half a second plus half the time of the exchange.
//
//   > 05 04 00 63 01     the last byte arrives at 12:00:00.000
//   < 05 30 00 15 …      15:00:30 at +03:00; the first byte comes at 12:00:00.020       +30.49 s

bool AsksClock(View pdu);

class ClockDrift {
 public:
  /// A drift that was measured longer ago than this is not used.
  static constexpr Duration kFresh = std::chrono::hours(1);
  /// If more time passes between the first sending and the reply, the drift is uncertain.
  static constexpr Duration kWidest = std::chrono::seconds(1);

  void OnHostClock(bool right) { right_ = right; }
  /// Call it when a request for the clock is built, before it is sent.
  void OnAsked() { first_.reset(); }
  /// Call it each time the request is sent. `arrives`: when its last byte arrives.
  void OnSent(Now arrives, Duration character);

  /// Returns the drift in seconds, positive if the meter is ahead. Its quality is good only if this
  /// machine's clock is synchronised. `data`: the data of the reply; the whole reply had `bytes`
  /// bytes and was complete at `now`.
  Decoded Of(View data, std::size_t bytes, const Scale& scale, Instant now);
  /// Returns the drift that Of returned last, if it was good and is not older than kFresh; else
  /// nothing.
  std::optional<double> Latest(Instant now) const;
  /// Call it if the clock was corrected, or another meter may be connected.
  void Forget() { latest_.reset(); }

 private:
  bool right_ = false;
  std::optional<Instant> first_;  // when the last byte of the first request arrived
  Now arrives_{};                 // when the last byte of the latest request arrived
  Duration character_{};
  std::optional<double> latest_;
  Instant latest_at_{};
};

/// Returns the PDU that corrects the clock, or an error. `value`: the seconds to add, or true to
/// remove the measured drift.
Result<Bytes> ClockCorrection(const Value& value, const ClockDrift& drift, Instant now);

}  // namespace baudgate::protocols::set4tm
