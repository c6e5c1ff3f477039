// Whether a configuration that was applied for a trial stays: until it is confirmed in time, it is
// given up when the time is over, or at once when devices that were well before are not any more.
// Pure: no clock, no gateway.
//
//   Begin(0 s, 60 s, {bay-1.a})
//   Look(5 s, a well)       nothing
//   Look(5 s, a offline)    "bay-1.a worked before, and does not any more"
//   Look(60 s)              "nobody has confirmed it in time"
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "gateway/base/time.h"

namespace baudgate::reload {

enum class Health : std::uint8_t {
  well,     ///< it answers, and is what it should be
  unknown,  ///< it has not been asked long enough since the port was opened or came back
  ill,      ///< it does not answer, or is another one
  unasked,  ///< out of use, or its port is lent: nobody wants to know
};

/// "bay-1.feeder-1" → how it is. Devices that are not there are not asked for any more.
using Healths = std::map<std::string, Health>;

class Probation {
 public:
  /// A device of which nothing is known for this time is ill; half of the trial, if that is
  /// shorter.
  static constexpr Duration kTimeToAnswer = 20s;

  /// Also while one runs, which it takes the place of: what was well before that counts on.
  void Begin(Instant now, Duration time, const Healths& before);
  bool running() const { return until_.has_value(); }
  Instant until() const { return until_.value_or(Instant::max()); }
  /// Why it is to be given up; empty: it goes on, or none runs.
  std::optional<std::string> Look(Instant now, const Healths& healths);
  /// It has ended, either way.
  void End();

 private:
  std::optional<Instant> until_;
  Duration patience_{};
  /// What was well before: when it was last seen otherwise than unknown. Empty while none runs.
  std::map<std::string, Instant> well_;
};

}  // namespace baudgate::reload
