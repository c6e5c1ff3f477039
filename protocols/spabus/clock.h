// The time for all relays of a line: T, the second of the minute, and D, date and time, sent to
// slave 900 and answered by none. When each is due, and what it says: the moment at which its last
// character arrives. Nothing is sent while this machine's own clock is not known to be right.
// Source: spa-bus reference, 13.
//
//   > >900WT:12.345:                    arrives at 12.345 s of the minute
//   > >900WD:24-02-29 23.59;58.125:     a relay of the SPACOM series knows T alone
//
// ClockOffset measures how far a relay's clock is off.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/time.h"
#include "gateway/base/value.h"

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

// How far a relay's clock is from this machine's: T, the second of its minute, against the middle
// of the time in which it must have looked at its clock. Read only; nothing is set.
//
//   > >1RT:…          the last character arrives at 12:00:00.000
//   < <1D:01.510:…    the first character comes at 12:00:00.020      1.510 - 0.010 = 1.500 s ahead
//
// Whole minutes do not show: from -30 s to 30 s. Source: spa-bus reference, 5 and 13; that the time
// is that between request and reply is inferred.

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
