// When an absent device may be probed, so that absent devices cost the others next to nothing:
// probes take idle time freely, and at most a capped share of the time that others want.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>

#include "gateway/base/time.h"

namespace baudgate {

class ProbeBudget {
 public:
  static constexpr double kShare = 0.02;
  /// The least time between two probes of a line, also of a dead one.
  static constexpr Duration kPause = 250ms;

  /// `share`: the part of the time wanted by living devices that probes may take.
  explicit ProbeBudget(double share = kShare) : share_(share) {}

  /// When a probe that costs the line at most `worst_cost` may be sent. `next_due`: when a living
  /// device wants the line again; empty: no living device does. `idle_since`: when the line
  /// became idle; a probe that will make others wait is sent at that moment only, when it makes
  /// them wait least. Empty: not before the next exchange.
  std::optional<Instant> NextProbe(Instant now, std::optional<Instant> next_due, Instant idle_since,
                                   Duration worst_cost) const;

  /// A probe took the line from `from` to `to`, and living devices waited for it for `waited`.
  void OnProbe(Instant from, Instant to, Duration waited);

  /// When a probe may make others wait again.
  Instant earned_at() const { return std::max(pause_until_, share_free_at_); }

  /// From a probe that took `cost` and made others wait for `waited` to the next one, at most.
  static Duration Interval(Duration cost, Duration waited, double share = kShare);

 private:
  double share_;
  Instant pause_until_{};
  Instant share_free_at_{};  // when the capped share has been earned again
};

}  // namespace baudgate
