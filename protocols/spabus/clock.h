// `ClockMessages` sends the time to all relays of a line: T, the second of the minute, and D, date
// and time, as writes to slave 900, which no relay answers. The text contains the moment at which
// its last character arrives. Nothing is sent unless this machine's clock is synchronised. Source:
// spa-bus reference, 13.
//
//   > >900WT:12.345:                    arrives at 12.345 s of the minute
//   > >900WD:24-02-29 23.59;58.125:     a relay of the SPACOM series supports T only
//
// `ClockOffset` measures the error of a relay's clock.
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

/// The time zone of the message D. The enumerators are in the order of the words of the option
/// `date_zone`.
enum class Zone : std::uint8_t {
  local,     ///< time zone of this machine, with summer time
  standard,  ///< time zone of this machine, without summer time
  utc,
};

struct ClockSettings {
  Duration seconds{};  ///< interval between two messages T (seconds); zero: T is never sent
  Duration date{};     ///< interval between two messages D (date); zero: D is never sent
  Zone zone = Zone::local;
  /// Delay of converters on the way, in addition to the duration of the characters.
  Duration delay{};
};

class ClockMessages {
 public:
  explicit ClockMessages(bool right = false) : right_(right) {}

  void OnHostClock(bool right);
  bool right() const { return right_; }

  /// Returns the message to send now, 'D' before 'T'. Empty: no message is due.
  std::optional<char> Due(const ClockSettings& settings, Instant now) const;
  void OnSent(char item, Instant now);

 private:
  bool right_;
  std::optional<Instant> seconds_sent_;
  std::optional<Instant> date_sent_;
};

/// Returns the text of the message T or D. Its length depends on `item` only.
std::string ClockText(char item, WallTime time, Zone zone);

// ClockOffset measures the difference between a relay's clock and this machine's clock: it compares
// T, the second of the relay's minute, with the middle of the time in which the relay read its
// clock.
//
//   > >1RT:…          the last character arrives at 12:00:00.000
//   < <1D:01.510:…    the first character comes at 12:00:00.020      1.510 - 0.010 = 1.500 s ahead
//
// Whole minutes are not measured: the result is from -30 s to 30 s. Source: spa-bus reference, 5
// and 13; it is inferred that the relay reads its clock between request and reply.

/// The `read` text of a point for the clock offset.
inline constexpr std::string_view kOffsetItem = "T offset";

/// Parses the seconds of a minute, such as "12.345". Empty: the text has another form.
std::optional<Duration> SecondsOf(std::string_view data);

class ClockOffset {
 public:
  /// If the time between request and reply is longer, the offset is uncertain, because it is
  /// unknown when the relay read its clock.
  static constexpr Duration kWidest = 500ms;

  /// Call it when a request for T was made, before it is sent.
  void OnAsked() { first_.reset(); }
  /// Call it each time the request is sent. `arrives`: when its last character arrives.
  /// `character`: the duration of one character.
  void OnSent(Now arrives, Duration character);

  struct Offset {
    Value value;  ///< offset in seconds; positive if the relay's clock is ahead
    Quality quality;
  };
  /// Returns the offset for a reply of `characters` characters that was complete at `now`. `data`:
  /// the data of the reply. `right`: true if this machine's clock is synchronised.
  Offset Of(std::string_view data, std::size_t characters, Instant now, bool right) const;

 private:
  std::optional<Instant> first_;  // when the last byte of the first request arrives
  Now arrives_{};                 // when the last byte of the latest request arrives
  Duration character_{};
};

}  // namespace baudgate::protocols::spabus
