// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/probe_budget.h"

#include <algorithm>

namespace baudgate {
namespace {

/// How long a share takes to earn this time.
Duration TimeToEarn(Duration time, double share) {
  return Duration(static_cast<std::int64_t>(static_cast<double>(time.count()) / share));
}

}  // namespace

std::optional<Instant> ProbeBudget::NextProbe(Instant now, std::optional<Instant> next_due,
                                              Instant idle_since, Duration worst_cost) const {
  const Instant earliest = std::max(now, pause_until_);
  const bool fits_in_idle_time = !next_due || earliest + worst_cost <= *next_due;
  if (fits_in_idle_time) return earliest;
  if (idle_since == now && earliest == now && share_free_at_ <= now) return now;
  return std::nullopt;
}

void ProbeBudget::OnProbe(Instant from, Instant to, Duration waited) {
  pause_until_ = to + kPause;
  if (waited > Duration::zero()) share_free_at_ = from + TimeToEarn(waited, share_);
}

Duration ProbeBudget::Interval(Duration cost, Duration waited, double share) {
  return std::max(cost + kPause, TimeToEarn(waited, share));
}

}  // namespace baudgate
