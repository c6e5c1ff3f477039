// The last hour of a device in minutes: how much of it was answered, and what the line's time went
// to. Written by gateway/bus/counters/device_accounts.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "gateway/base/time.h"

namespace baudgate {

/// The counts of some minutes.
struct MinuteCounts {
  std::uint32_t answered = 0;  ///< exchanges
  std::uint32_t failed = 0;    ///< exchanges
  std::uint32_t repeats = 0;   ///< failed ones that were tried again
  std::uint32_t missed = 0;    ///< poll periods for which there was no time
  std::uint32_t outages = 0;   ///< failures of a request and all its repeats, that began
  Duration up{};               ///< it answered
  Duration down{};             ///< it did not
  Duration served{};           ///< line time of exchanges that were answered
  Duration wasted{};           ///< line time of those that were not, and of the silence after them

  MinuteCounts& operator+=(const MinuteCounts& other);
};

/// The part of the time in which it answered; 1 if it was not asked.
double Availability(const MinuteCounts& tally);

class LastHour {
 public:
  static constexpr std::size_t kMinutes = 60;

  /// The minute to count in.
  MinuteCounts& At(Instant now);
  /// The present minute and this many full ones before it, at most kMinutes in all.
  MinuteCounts Sum(Instant now, std::size_t full_minutes = kMinutes - 1) const;
  /// Each of them, the present minute last.
  std::array<MinuteCounts, kMinutes> All(Instant now) const;

 private:
  struct Minute {
    std::int64_t number = -1;
    MinuteCounts tally;
  };
  std::array<Minute, kMinutes> minutes_{};
};

}  // namespace baudgate
