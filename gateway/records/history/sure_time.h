// By which time files are judged too old. The clock of a machine may be wrong by years for a few
// seconds, or from the start on; what is deleted by it does not come back when it is set.
//
//   start, newest file of 20 Nov, clock says 2099    → for a day nothing; then 21 Nov + uptime
//   clock set by more than a minute                  → for a day nothing
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/time.h"
#include "gateway/records/history/entry.h"

namespace baudgate::history {

class SureTime {
 public:
  /// A clock must have gone on so long, by itself.
  static constexpr Duration kSettled = kDay * 1ms;
  /// One that goes faster or slower than this between two looks was set. Less is no harm.
  static constexpr Duration kStep = 1min;

  /// `newest`: begin of the newest day of which there are files; empty: there are none.
  void Begin(Now now, std::optional<Millis> newest);
  /// Often. Empty: the clock is not to be trusted yet; else it is not after `now`.
  std::optional<Millis> Look(Now now);

 private:
  Instant began_;
  Millis latest_ = 0;  // that it could have been when it began
  Now last_{};
  Instant settles_;
};

}  // namespace baudgate::history
