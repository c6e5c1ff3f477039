// `ClockMessages` sends the time to all relays of a line: T, the second of the minute, and D, date
// and time, as writes to slave 900, which no relay answers. The text contains the moment at which
// its last character arrives. Nothing is sent unless this machine's clock is known to be right.
// Source: spa-bus reference, 13.
//
//   > >900WT:12.345:                    arrives at 12.345 s of the minute
//   > >900WD:24-02-29 23.59;58.125:     a relay of the SPACOM series supports T only
//
// `ClockOffset` measures how far a relay's clock is off.
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

/// The time zone of D, in the order of the words of the option `date_zone`.
enum class Zone : std::uint8_t {
  local,     ///< time of this machine, with summer time
  standard,  ///< time of this machine, without summer time
  utc,
};

struct ClockSettings {
  Duration seconds{};  ///< interval of T; zero: never sent
  Duration date{};     ///< interval of D; zero: never sent
  Zone zone = Zone::local;
  Duration delay{};  ///< delay of converters on the way, beyond the characters
};

/// The clock messages of one line, shared by its relays.
class ClockMessages {
 public:
  explicit ClockMessages(bool right = false) : right_(right) {}

  void OnHostClock(bool right);
  bool right() const { return right_; }

  /// Returns the item to send now, D before T; empty: none is due.
  std::optional<char> Due(const ClockSettings& settings, Instant now) const;
  void OnSent(char item, Instant now);

 private:
  bool right_;
  std::optional<Instant> seconds_sent_;
  std::optional<Instant> date_sent_;
};

/// Returns the text of T or D; its length depends on the item only.
std::string ClockText(char item, WallTime time, Zone zone);

// Measures how far a relay's clock is from this machine's clock: compares T, the second of the
// relay's minute, with the middle of the time in which the relay read its clock.
//
//   > >1RT:…          the last character arrives at 12:00:00.000
//   < <1D:01.510:…    the first character comes at 12:00:00.020      1.510 - 0.010 = 1.500 s ahead
//
// Whole minutes do not show: the result is from -30 s to 30 s. Source: spa-bus reference, 5 and 13;
// that the relay reads its clock between request and reply is inferred.

/// The text in a point's `read` for the clock offset.
inline constexpr std::string_view kOffsetItem = "T offset";

/// Reads "12.345". Empty: the text is no second of a minute.
std::optional<Duration> SecondsOf(std::string_view data);

class ClockOffset {
 public:
  /// In a longer time between request and reply it is unknown when the relay read its clock.
  static constexpr Duration kWidest = 500ms;

  /// A request for T was made, but is not sent yet.
  void OnAsked() { first_.reset(); }
  /// The request is sent, perhaps a second time. `arrives`: when its last character arrives;
  /// `character`: the time of one character.
  void OnSent(Now arrives, Duration character);

  struct Offset {
    Value value;  ///< seconds; positive if the relay's clock is ahead
    Quality quality;
  };
  /// Returns the offset for a reply of `characters` characters that was complete at `now`. `right`:
  /// this machine's clock is known to be right.
  Offset Of(std::string_view data, std::size_t characters, Instant now, bool right) const;

 private:
  std::optional<Instant> first_;  // when the request was sent first
  Now arrives_{};                 // when the request was sent last
  Duration character_{};
};

}  // namespace baudgate::protocols::spabus
