// The time for all relays of a line: T, the second of the minute, and D, date and time, sent to
// slave 900 and answered by none. When each is due, and what it says: the moment at which its last
// character arrives. Nothing is sent while this machine's own clock is not known to be right.
// Source: spa-bus reference, 13.
//
//   > >900WT:12.345:                    arrives at 12.345 s of the minute
//   > >900WD:24-02-29 23.59;58.125:     a relay of the SPACOM series knows T alone
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gateway/base/time.h"

namespace baudgate::protocols::spabus {

inline constexpr char kSeconds = 'T';
inline constexpr char kDate = 'D';

/// What D counts its hours in; in the order of the words of the option `date_zone`.
enum class Zone : std::uint8_t {
  local,     ///< of this machine, with its summer time
  standard,  ///< the same, without summer time
  utc,
};

struct ClockSettings {
  Duration seconds{};  ///< how often T is sent; zero: never
  Duration date{};     ///< D, likewise
  Zone zone = Zone::local;
  Duration delay{};  ///< of converters on the way, beyond the characters themselves
};

/// The clock messages of one line, shared by its relays.
class ClockMessages {
 public:
  explicit ClockMessages(bool right = false) : right_(right) {}

  /// This machine's clock is known to be right, or not any more.
  void OnHostClock(bool right);
  bool right() const { return right_; }

  /// The item that is to be sent now; D first.
  std::optional<char> Due(const ClockSettings& settings, Instant now) const;
  void OnSent(char item, Instant now);

 private:
  bool right_;
  std::optional<Instant> seconds_sent_;
  std::optional<Instant> date_sent_;
};

/// Always of the same length for one item.
std::string ClockText(char item, WallTime time, Zone zone);

}  // namespace baudgate::protocols::spabus
