// Probes of dead devices: free in idle time, capped where the living wait.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/probe_budget.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

constexpr Instant kStart = Instant() + 1h;

TEST(ProbeBudget, IdleLineProbesAfterThePause) {
  ProbeBudget budget;
  EXPECT_EQ(budget.NextProbe(kStart, std::nullopt, 600ms), kStart);
  budget.OnProbe(kStart, kStart + 600ms, false);
  EXPECT_EQ(budget.NextProbe(kStart + 600ms, std::nullopt, 600ms),
            kStart + 600ms + ProbeBudget::kPause);
}

TEST(ProbeBudget, IdleTimeThatIsLongEnoughIsFree) {
  ProbeBudget budget;
  budget.OnProbe(kStart, kStart + 600ms, true);
  const Instant later = kStart + 2s;
  EXPECT_EQ(budget.NextProbe(later, later + 600ms, 600ms), later);
  EXPECT_GT(budget.NextProbe(later, later + 599ms, 600ms), later) << "it would delay a poll";
}

TEST(ProbeBudget, ContendedProbesTakeTheCappedShareAtMost) {
  ProbeBudget budget;
  Duration spent{};
  Instant now = kStart;
  while (now < kStart + 1h) {
    const Instant probe = budget.NextProbe(now, now, 600ms);  // a poll is due all the time
    if (probe <= now) {
      budget.OnProbe(now, now + 600ms, true);
      spent += 600ms;
      now += 600ms;
    } else {
      now = probe;
    }
  }
  const double share =
      static_cast<double>(spent.count()) / static_cast<double>(Duration(1h).count());
  EXPECT_LE(share, ProbeBudget::kShare * 1.02);
  EXPECT_GE(share, ProbeBudget::kShare * 0.9) << "a dead device would never be found again";
}

}  // namespace
}  // namespace baudgate
