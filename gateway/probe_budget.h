// When an offline device may be asked whether it is back, so that dead devices cost the living next
// to nothing: probes take idle time freely, and at most a capped share of time that others want.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/time.h"

namespace baudgate {

class ProbeBudget {
 public:
  static constexpr double kShare = 0.02;
  /// Between two probes of a line, whatever else: a dead line is not hammered.
  static constexpr Duration kPause = 250ms;

  /// When a probe that costs the line at most `worst_cost` may be sent. `next_due`: when a living
  /// device wants the line again; nothing: no living device does.
  Instant NextProbe(Instant now, std::optional<Instant> next_due, Duration worst_cost) const;

  /// A probe took the line from `from` to `to`; `contended`: a living device was waiting meanwhile.
  void OnProbe(Instant from, Instant to, bool contended);

 private:
  Instant pause_until_{};
  Instant share_free_at_{};  // when the capped share has been earned again
};

}  // namespace baudgate
