// SPDX-License-Identifier: Apache-2.0
#include "gateway/probe_budget.h"

#include <algorithm>

namespace baudgate {

Instant ProbeBudget::NextProbe(Instant now, std::optional<Instant> next_due,
                               Duration worst_cost) const {
  const Instant earliest = std::max(now, pause_until_);
  const bool fits_in_idle_time = !next_due || earliest + worst_cost <= *next_due;
  if (fits_in_idle_time) return earliest;
  return std::max(earliest, share_free_at_);
}

void ProbeBudget::OnProbe(Instant from, Instant to, bool contended) {
  pause_until_ = to + kPause;
  if (!contended) return;
  const double cost = static_cast<double>((to - from).count());
  share_free_at_ = from + Duration(static_cast<std::int64_t>(cost / kShare));
}

}  // namespace baudgate
