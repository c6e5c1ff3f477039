// When the queries of one group are due, and which periods it has missed.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/schedule/schedule.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

TEST(Round, BeginsOnItsGridAndSkipsPeriodsThatHavePassedWhole) {
  const struct {
    const char* what;
    Duration period;
    Duration begun;  // after it was due
    std::uint32_t missed;
    std::optional<Duration> next;
  } kRows[] = {{"not yet due", 5s, -1ms, 0, 0s},
               {"in time", 5s, 0s, 0, 5s},
               {"late", 5s, 1s, 0, 5s},
               {"by two periods", 5s, 12s, 2, 15s},
               {"once", 0s, 12s, 0, std::nullopt}};
  for (const auto& row : kRows) {
    SCOPED_TRACE(row.what);
    Round round{.queries = {7}, .period = row.period, .due = kStart, .cursor = 1};
    EXPECT_EQ(round.Passed(kStart + row.begun), row.missed);
    EXPECT_EQ(round.StartIfDue(kStart + row.begun), row.missed);
    EXPECT_EQ(round.active(), row.begun >= 0s);
    EXPECT_EQ(round.due, row.next ? std::optional(kStart + *row.next) : std::nullopt);
    if (round.active()) {
      EXPECT_EQ(round.StartIfDue(kStart + 1h), 0U) << "its queries come first";
    }
  }
}

TEST(Round, IsNeverDueWhileItIsHeld) {
  Round round{.queries = {7}, .period = 5s, .due = kStart + 3s, .cursor = 1};
  round.Block();
  round.Restart(kStart);
  EXPECT_EQ(round.StartIfDue(kStart + 1h), 0U);
  EXPECT_FALSE(round.active());
  EXPECT_EQ(round.planned, kStart + 3s);
}

TEST(Round, IsRepeatedOnceAndOnlyEarlier) {
  Round round{.queries = {7}, .period = 24h, .due = kStart + 10s, .cursor = 1};
  round.Repeat(kStart + 20s);
  EXPECT_EQ(round.due, kStart + 10s);
  round.Repeat(kStart + 5s);
  round.Repeat(kStart + 1s);
  EXPECT_EQ(round.due, kStart + 5s);
}

}  // namespace
}  // namespace baudgate
