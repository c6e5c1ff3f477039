// The schedule alone: groups that are read once or daily, and what a new plan leaves of them.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <optional>

#include "gateway/bus/schedule/schedule.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

using config::Group;

TEST(Schedule, OnceIsAskedOnceUntilRestart) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::once});
  schedule.Restart(0, kStart);
  const auto pick = schedule.Next(kStart);
  ASSERT_TRUE(pick);
  EXPECT_EQ(pick->group, Group::once);
  EXPECT_FALSE(schedule.Next(kStart + 24h));
  EXPECT_FALSE(schedule.NextDue());
  schedule.Restart(0, kStart + 24h);
  EXPECT_TRUE(schedule.Next(kStart + 24h));
}

TEST(Schedule, OnceIsRepeatedWhenAskedTo) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::once, Group::once});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  schedule.Repeat(0, Group::once, kStart + 1min);
  ASSERT_TRUE(schedule.Next(kStart)) << "the round that is under way goes on";
  EXPECT_FALSE(schedule.Next(kStart + 59s));
  EXPECT_TRUE(schedule.Next(kStart + 1min));
  EXPECT_TRUE(schedule.Next(kStart + 1min));
  EXPECT_FALSE(schedule.Next(kStart + 24h));
}

TEST(Schedule, ANewPlanStartsAgainWithWhatWasNotYetReadOnce) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::once, Group::once});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  schedule.SetQueries(0, {Group::once});
  EXPECT_TRUE(schedule.Next(kStart));
  schedule.SetQueries(0, {Group::once});
  EXPECT_FALSE(schedule.Next(kStart)) << "all had been asked for";
}

TEST(Schedule, DailyIsAskedAtTheStartAndThenOnceADay) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h), {Group::daily, Group::daily});
  schedule.Restart(0, kStart);
  for (int day = 0; day < 3; ++day) {
    const Instant start = kStart + day * 24h;
    EXPECT_TRUE(schedule.Next(start));
    EXPECT_TRUE(schedule.Next(start));
    EXPECT_FALSE(schedule.Next(start + 24h - 1s));
  }
}

TEST(Schedule, WhatFailedOfTheDayIsRepeatedOnceAndTheDayBeginsThere) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h), {Group::daily});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  schedule.Repeat(0, Group::daily, kStart + 1h);
  schedule.Repeat(0, Group::daily, kStart + 1min);  // the first wish counts
  EXPECT_FALSE(schedule.Next(kStart + 59min));
  EXPECT_TRUE(schedule.Next(kStart + 1h));
  EXPECT_FALSE(schedule.Next(kStart + 24h));
  EXPECT_TRUE(schedule.Next(kStart + 25h));
}

TEST(Schedule, ANewPlanPassesNothingOfTheDayOver) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h), std::vector(4, Group::daily));
  schedule.Restart(0, kStart);
  ASSERT_EQ(schedule.Next(kStart)->query, 0U);
  ASSERT_EQ(schedule.Next(kStart)->query, 1U);
  schedule.SetQueries(0, std::vector(3, Group::daily));  // query 1 was refused
  ASSERT_EQ(schedule.Next(kStart)->query, 1U);
  schedule.SetQueries(0, std::vector(5, Group::daily));  // something was split
  for (std::size_t query = 0; query < 5; ++query) EXPECT_EQ(schedule.Next(kStart)->query, query);
  EXPECT_FALSE(schedule.Next(kStart + 23h));
  EXPECT_TRUE(schedule.Next(kStart + 24h));
  EXPECT_EQ(schedule.Missed(0, kStart + 24h), 0U);
}

TEST(Schedule, ARestartAsPlannedGoesOnWithTheDay) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h), std::vector(3, Group::daily));
  schedule.Restart(0, kStart);
  ASSERT_EQ(schedule.Next(kStart)->query, 0U);
  schedule.SetQueries(0, std::vector(2, Group::daily));  // that was refused
  schedule.RestartAsPlanned(0, kStart);
  EXPECT_EQ(schedule.Next(kStart)->query, 0U);
  EXPECT_EQ(schedule.Next(kStart)->query, 1U);
  EXPECT_FALSE(schedule.Next(kStart));
  schedule.RestartAsPlanned(0, kStart + 9h);  // none is under way
  EXPECT_EQ(schedule.Next(kStart + 9h)->query, 0U);
}

TEST(Schedule, ANewPlanGoesOnWhereItWas) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h),
                      {Group::fast, Group::fast, Group::slow, Group::once});
  schedule.Restart(0, kStart);
  const auto next = [&](Instant now) {
    const auto pick = schedule.Next(now);
    return pick ? std::optional(pick->query) : std::nullopt;
  };
  for (int i = 0; i < 3; ++i) next(kStart);
  // The last of the fast ones was split; all else was asked.
  ASSERT_EQ(next(kStart), 1U);
  schedule.SetQueries(0, {Group::fast, Group::fast, Group::fast, Group::slow, Group::once});
  schedule.GoOn(0, kStart);
  EXPECT_EQ(next(kStart), 1U);
  EXPECT_EQ(next(kStart), 2U);
  EXPECT_EQ(next(kStart), std::nullopt) << "neither the slow one nor that which is read once";
  // The first one is set apart, so that it is asked daily.
  ASSERT_EQ(next(kStart + 1s), 0U);
  schedule.SetQueries(0, {Group::fast, Group::fast, Group::slow, Group::daily, Group::once});
  schedule.GoOn(0, kStart + 1s);
  EXPECT_EQ(next(kStart + 1s), 0U);
  EXPECT_EQ(next(kStart + 1s), 1U);
  EXPECT_EQ(next(kStart + 1s), std::nullopt) << "it was asked a moment ago";
  EXPECT_EQ(schedule.Missed(0, kStart + 1s), 0U);
  int daily = 0;
  for (Instant now = kStart + 1s; now < kStart + 1s + 24h; now += 10min) {
    while (const auto pick = schedule.Next(now)) daily += pick->group == Group::daily ? 1 : 0;
  }
  EXPECT_EQ(daily, 0);
  EXPECT_EQ(schedule.Next(kStart + 1s + 24h)->group, Group::daily);
}

TEST(Schedule, WhatHadNoQueriesForLongMissedNothing) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h), {Group::fast});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  schedule.SetQueries(0, {Group::slow});
  schedule.GoOn(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  for (int minute = 1; minute < 60; ++minute) schedule.Next(kStart + minute * 1min);
  schedule.SetQueries(0, {Group::fast});
  schedule.GoOn(0, kStart + 1h);
  ASSERT_TRUE(schedule.Next(kStart + 1h + 1s));
  EXPECT_EQ(schedule.Missed(0, kStart + 1h + 1s), 0U);
}

}  // namespace
}  // namespace baudgate
