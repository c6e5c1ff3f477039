// Probes of dead devices: free in idle time, capped where the living wait.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/schedule/probes.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

TEST(ProbeBudget, IdleLineProbesAfterThePause) {
  ProbeBudget budget;
  EXPECT_EQ(budget.NextProbe(kStart, std::nullopt, kStart, 600ms), kStart);
  budget.OnProbe(kStart, kStart + 600ms, 0ms);
  EXPECT_EQ(budget.NextProbe(kStart + 600ms, std::nullopt, kStart + 600ms, 600ms),
            kStart + 600ms + ProbeBudget::kPause);
}

TEST(ProbeBudget, IdleTimeThatIsLongEnoughIsFree) {
  ProbeBudget budget;
  budget.OnProbe(kStart, kStart + 600ms, 600ms);
  const Instant later = kStart + 2s;
  EXPECT_EQ(budget.NextProbe(later, later + 600ms, kStart, 600ms), later);
  EXPECT_EQ(budget.NextProbe(later, later + 599ms, later, 600ms), std::nullopt)
      << "it would delay a poll, and the share is not earned yet";
}

TEST(ProbeBudget, AProbeThatMakesOthersWaitIsSentWhenTheyWaitLeast) {
  ProbeBudget budget;
  const Instant due = kStart + 500ms;
  EXPECT_EQ(budget.NextProbe(kStart, due, kStart, 600ms), kStart) << "they wait 100 ms";
  EXPECT_EQ(budget.NextProbe(kStart + 200ms, due, kStart, 600ms), std::nullopt);
  EXPECT_EQ(budget.NextProbe(due, due, kStart, 600ms), std::nullopt) << "it is their turn";
}

TEST(ProbeBudget, OnlyTheWaitOfOthersIsCharged) {
  ProbeBudget budget;
  budget.OnProbe(kStart, kStart + 600ms, 100ms);
  const Instant earned = kStart + 5s;  // 100 ms / 2 %
  EXPECT_EQ(budget.NextProbe(earned - 1ms, earned, earned - 1ms, 600ms), std::nullopt);
  EXPECT_EQ(budget.NextProbe(earned, earned, earned, 600ms), earned);
}

TEST(ProbeBudget, ContendedProbesTakeTheCappedShareAtMost) {
  ProbeBudget budget;
  Duration spent{};
  for (Instant now = kStart; now < kStart + 1h;) {
    // A poll is due all the time, and one has just ended.
    const bool probe = budget.NextProbe(now, now, now, 600ms) == now;
    const Duration took = probe ? 600ms : 20ms;
    if (probe) budget.OnProbe(now, now + took, took);
    if (probe) spent += took;
    now += took;
  }
  const double share =
      static_cast<double>(spent.count()) / static_cast<double>(Duration(1h).count());
  EXPECT_LE(share, ProbeBudget::kShare * 1.02);
  EXPECT_GE(share, ProbeBudget::kShare * 0.9) << "a dead device would never be found again";
}

TEST(ProbeBudget, TheIntervalIsThatOfThePauseOrOfTheShare) {
  EXPECT_EQ(ProbeBudget::Interval(600ms, 0ms), 850ms);
  EXPECT_EQ(ProbeBudget::Interval(600ms, 600ms), 30s);
}

}  // namespace
}  // namespace baudgate
