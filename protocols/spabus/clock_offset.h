// How far a relay's clock is from this machine's: T, the second of its minute, against the middle
// of the time in which it must have looked at its clock. Read only; nothing is set.
//
//   > >1RT:…          the last character arrives at 12:00:00.000
//   < <1D:01.510:…    the first character comes at 12:00:00.020      1.510 - 0.010 = 1.500 s ahead
//
// Whole minutes do not show: from -30 s to 30 s. Source: spa-bus reference, 5 and 13; that the time
// is that between request and reply is inferred.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "gateway/base/quality.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate::protocols::spabus {

/// What stands in a point's `read` for it.
inline constexpr std::string_view kOffsetItem = "T offset";

/// "12.345"; empty: it is no second of a minute.
std::optional<Duration> SecondsOf(std::string_view data);

class ClockOffset {
 public:
  /// Wider than this nobody knows when the relay looked at its clock.
  static constexpr Duration kWidest = 500ms;

  /// A request for T is made: it has not been sent yet.
  void OnAsked() { first_.reset(); }
  /// It is sent, perhaps once more: its last character arrives then.
  void OnSent(Now arrives, Duration character);

  struct Offset {
    Value value;  ///< seconds, positive where the relay is ahead
    Quality quality;
  };
  /// The reply has come whole at `now` and has so many characters. `right`: this machine's clock is
  /// known to be.
  Offset Of(std::string_view data, std::size_t characters, Instant now, bool right) const;

 private:
  std::optional<Instant> first_;  // when it was sent first
  Now arrives_{};                 // when it was sent last
  Duration character_{};
};

}  // namespace baudgate::protocols::spabus
