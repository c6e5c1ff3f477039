// Tests of `Schedule`: polls at multiples of their period, fairness, missed periods, events,
// restarts, and a held schedule.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/schedule.h"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <random>

#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

using config::Group;
using Brought = Schedule::Brought;

TEST(Schedule, NothingIsDueBeforeRestart) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
  EXPECT_FALSE(schedule.Next(kStart));
  EXPECT_FALSE(schedule.NextDue());
}

TEST(Schedule, PeriodsKeepAFixedGrid) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart + 130ms)) << "asked late";
  EXPECT_EQ(schedule.NextDue(), kStart + 1s) << "late service must not shift the grid";
  EXPECT_FALSE(schedule.Next(kStart + 999ms));
  EXPECT_TRUE(schedule.Next(kStart + 1s));
  EXPECT_EQ(schedule.NextDue(), kStart + 2s);
  EXPECT_EQ(schedule.Missed(0, kStart), 0U);
}

TEST(Schedule, OwnIntervalsHaveTheirOwnGrids) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h, {5ms, 250ms}),
                      {Group::fast, Group::own, config::OwnGroup(1)}, true);
  schedule.Restart(0, kStart);
  std::map<std::size_t, int> picked;
  for (Instant now = kStart; now < kStart + 1s; now += 1ms) {
    while (const auto pick = schedule.Next(now)) {
      ++picked[pick->query];
      if (pick->query == 2) {
        EXPECT_EQ(pick->group, config::OwnGroup(1));
      }
    }
  }
  EXPECT_EQ(picked[0], 1);
  EXPECT_EQ(picked[1], 200);
  EXPECT_EQ(picked[2], 4);
  EXPECT_EQ(picked[kEventsQuery], 1);
  EXPECT_EQ(schedule.Missed(0, kStart + 999ms), 0U);
  EXPECT_EQ(schedule.Missed(0, kStart + 1s + 50ms), 10U) << "what is not asked is missed";
}

TEST(Schedule, AnUnansweredGroupIsRepeatedSoonAndThenLessOften) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1h), {Group::slow, Group::slow});
  schedule.Restart(0, kStart);
  Instant now = kStart;
  const auto round = [&](bool answered) {
    for (int query = 0; query < 2; ++query) {
      EXPECT_TRUE(schedule.Next(now));
      if (!answered) schedule.RepeatSoon(0, Group::slow, now, 1min);
    }
    const Duration wait = *schedule.NextDue() - now;
    now += wait;
    return wait;
  };
  for (const Duration wait : {8s, 16s, 32s}) EXPECT_EQ(round(false), wait);
  for (int i = 0; i < 60; ++i) EXPECT_EQ(round(false), 1min);
  EXPECT_EQ(round(true), 1h);
  EXPECT_EQ(round(false), 8s) << "it was answered in between";
  EXPECT_EQ(round(false), 16s);
  schedule.Restart(0, now);
  EXPECT_EQ(round(false), 8s);
  EXPECT_EQ(round(true), 1h);
  EXPECT_TRUE(schedule.Next(now));
  schedule.RepeatSoon(0, Group::slow, now, 5s);
  EXPECT_TRUE(schedule.Next(now));
  EXPECT_EQ(schedule.NextDue(), now + 5s);
}

TEST(Schedule, AFailingDeviceWaitsUntilNoHealthyDeviceIsDue) {
  Schedule schedule;
  for (std::size_t device = 0; device < 2; ++device) {
    schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast, Group::fast});
    schedule.Restart(device, kStart);
  }
  schedule.SetFailing(0, true);
  for (const std::size_t device : {1U, 1U, 0U, 0U}) {
    const auto pick = schedule.Next(kStart, true);
    ASSERT_TRUE(pick);
    EXPECT_EQ(pick->device, device);
  }
}

TEST(Schedule, OnlyADeviceThatIsPolledCountsAsAnotherFailingDevice) {
  Schedule schedule;
  for (std::size_t device = 0; device < 2; ++device) {
    schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
    schedule.Restart(device, kStart);
  }
  schedule.SetFailing(0, true);
  EXPECT_FALSE(schedule.AnotherFails(0)) << "it is the only one";
  EXPECT_TRUE(schedule.AnotherFails(1));
  schedule.Suspend(0);
  EXPECT_FALSE(schedule.failing(0));
  schedule.SetFailing(0, true);
  EXPECT_FALSE(schedule.AnotherFails(1));
  EXPECT_TRUE(schedule.HealthyDue(kStart));
  schedule.Next(kStart);
  EXPECT_FALSE(schedule.HealthyDue(kStart));
}

TEST(Schedule, QueriesOfARoundComeInTheirOrder) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast, Group::fast, Group::fast});
  schedule.Restart(0, kStart);
  for (std::size_t query = 0; query < 3; ++query) {
    const auto pick = schedule.Next(kStart);
    ASSERT_TRUE(pick);
    EXPECT_EQ(pick->query, query);
    EXPECT_EQ(pick->last_of_round, query == 2);
  }
  EXPECT_FALSE(schedule.Next(kStart));
}

TEST(Schedule, ASlowDeviceGetsFewerTurns) {
  Schedule schedule;
  const std::vector<Group> many(20, Group::fast);
  for (int device = 0; device < 2; ++device) {
    schedule.SetQueries(schedule.AddDevice(1s, 1min), many);
    schedule.Restart(static_cast<std::size_t>(device), kStart);
  }
  std::map<std::size_t, int> picked;
  for (int i = 0; i < 11; ++i) {
    const auto pick = schedule.Next(kStart);
    ASSERT_TRUE(pick);
    ++picked[pick->device];
    schedule.OnUsed(pick->device, pick->device == 0 ? 500ms : 50ms);
  }
  EXPECT_LE(picked[0], 2);
  EXPECT_GE(picked[1], 9);
}

TEST(Schedule, DevicesOfSimilarLineUseTakeTurns) {
  const struct {
    std::vector<std::size_t> asked;
    std::size_t busy;
    Duration used;
    std::size_t next;
  } kRows[] = {{{0, 1}, 0, 200ms, 0},
               {{0, 1}, 0, 201ms, 1},
               {{0, 1, 0}, 1, 200ms, 1},
               {{0, 1, 0}, 1, 201ms, 0}};
  for (const auto& row : kRows) {
    SCOPED_TRACE(FormatDuration(row.used));
    Schedule schedule;
    for (std::size_t device = 0; device < 2; ++device) {
      schedule.SetQueries(schedule.AddDevice(1s, 1min), std::vector<Group>(9, Group::fast));
      schedule.Restart(device, kStart);
    }
    for (const std::size_t device : row.asked) {
      ASSERT_EQ(schedule.Next(kStart)->device, device);
      if (device == row.busy) schedule.OnUsed(device, row.used);
    }
    EXPECT_EQ(schedule.Next(kStart)->device, row.next);
  }
}

TEST(Schedule, LineUseIsForgottenWhenThereWasTimeForAllDevices) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast, Group::fast});
  schedule.Restart(0, kStart);
  schedule.Restart(1, kStart);
  ASSERT_EQ(schedule.Next(kStart)->device, 0U);
  schedule.OnUsed(0, 500ms);
  while (schedule.Next(kStart)) {
  }
  EXPECT_EQ(schedule.Next(kStart + 1s)->device, 0U) << "it has waited longest";
}

TEST(Schedule, AnIdleDeviceGainsNoExtraTurns) {
  Schedule schedule;
  for (int device = 0; device < 2; ++device) {
    schedule.SetQueries(schedule.AddDevice(1s, 1min), std::vector<Group>(100, Group::fast));
  }
  schedule.Restart(0, kStart);
  for (int i = 0; i < 50; ++i) {
    schedule.Next(kStart);
    schedule.OnUsed(0, 50ms);
  }
  schedule.Restart(1, kStart);
  std::map<std::size_t, int> picked;
  for (int i = 0; i < 60; ++i) {
    const std::size_t device = schedule.Next(kStart)->device;
    ++picked[device];
    schedule.OnUsed(device, 50ms);
  }
  EXPECT_NEAR(picked[0], picked[1], 2);
}

TEST(Schedule, EventsAreRequestedWithThePollsAndAgainOnceStored) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast, Group::fast}, true);
  schedule.Restart(0, kStart);
  const auto ask = [&](Instant now) {
    const auto pick = schedule.Next(now);
    return pick ? pick->query : 99;
  };
  EXPECT_EQ(ask(kStart), 0U);
  EXPECT_EQ(ask(kStart), kEventsQuery) << "in turn with the polls";
  schedule.HoldEvents(0);
  EXPECT_EQ(ask(kStart), 1U);
  EXPECT_EQ(ask(kStart + 1s), 0U);
  EXPECT_EQ(ask(kStart + 1s), 1U) << "polls go on";
  EXPECT_EQ(ask(kStart + 1s), 99U);
  schedule.Restart(0, kStart + 1s);
  EXPECT_EQ(ask(kStart + 1s), 0U);
  EXPECT_EQ(ask(kStart + 1s), 1U);
  EXPECT_EQ(ask(kStart + 1s), 99U) << "the port has opened again, and they are not kept yet";
  schedule.ReleaseEvents(0, true, Brought::news, kStart + 1200ms);
  EXPECT_EQ(schedule.NextDue(), kStart + 1200ms);
  EXPECT_EQ(ask(kStart + 1200ms), kEventsQuery) << "at once";
  EXPECT_EQ(schedule.NextDue(), kStart + 2s);
}

TEST(Schedule, StoringOtherRecordsDoesNotChangeWhenEventsAreDue) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast}, true);
  schedule.Restart(0, kStart);
  while (schedule.Next(kStart)) {
  }
  const auto release = [&](Instant now) {
    schedule.HoldEvents(0);
    schedule.ReleaseEvents(0, true, Brought::something_else, now);
  };
  release(kStart + 300ms);
  EXPECT_EQ(schedule.NextDue(), kStart + 1s);
  schedule.HoldEvents(0);
  release(kStart + 1300ms);
  EXPECT_EQ(schedule.Next(kStart + 1300ms)->query, 0U);
  EXPECT_EQ(schedule.Next(kStart + 1300ms)->query, kEventsQuery) << "it has been due meanwhile";
  EXPECT_EQ(schedule.NextDue(), kStart + 2s);
}

TEST(Schedule, EventsThatWereDueWhenHeldAreDueAtOnceWhenReleased) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast}, true);
  schedule.Restart(0, kStart);
  ASSERT_EQ(schedule.Next(kStart)->query, 0U);
  schedule.HoldEvents(0);
  schedule.ReleaseEvents(0, true, Brought::something_else, kStart + 100ms);
  EXPECT_EQ(schedule.NextDue(), kStart + 100ms);
}

TEST(Schedule, AFloodingDeviceGetsAtMostOneExtraRound) {
  constexpr std::size_t kDevices = 3;
  constexpr int kSeconds = 100;
  Schedule schedule;
  for (std::size_t i = 0; i < kDevices; ++i) {
    schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast, Group::fast}, true);
    schedule.Restart(i, kStart);
  }
  std::map<std::size_t, int> events;
  int polls = 0;
  Duration latest{};
  for (Instant now = kStart; now < kStart + kSeconds * 1s; now += 20ms) {
    const auto pick = schedule.Next(now);
    if (!pick) continue;
    if (pick->query != kEventsQuery) {
      ++polls;
      latest = std::max<Duration>(latest, (now - kStart) % 1s);
      continue;
    }
    ++events[pick->device];
    if (pick->device != 0) continue;
    schedule.HoldEvents(0);
    schedule.ReleaseEvents(0, true, Brought::news, now);
  }
  EXPECT_EQ(polls, 6 * kSeconds);
  EXPECT_EQ(events[1], kSeconds);
  EXPECT_LE(latest, (6 + 3 + 6) * 20ms) << "a round of polls and events, and one more";
  EXPECT_GE(events[0], 6 * kSeconds);
  EXPECT_LE(events[0], 7 * kSeconds + 1) << "its turn, and as many as the line has queries";
}

TEST(Schedule, ALineWithFewQueriesAllowsFourEventRequestsAtOnce) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast}, true);
  schedule.SetQueries(schedule.AddDevice(1s, 1min), std::vector<Group>(9, Group::fast));
  schedule.Restart(0, kStart);
  for (int at_once = 0; at_once < 5; ++at_once) {
    while (schedule.Next(kStart)) {
    }
    schedule.HoldEvents(0);
    schedule.ReleaseEvents(0, true, Brought::news, kStart);
    EXPECT_EQ(schedule.NextDue(), at_once < 4 ? kStart : kStart + 1s);
  }
}

TEST(Schedule, HeldEventsStayHeldUntilReleased) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {}, true);
  schedule.Restart(0, kStart);
  schedule.HoldEvents(0);
  schedule.SetQueries(0, {}, true);
  schedule.GoOn(0, kStart);
  schedule.Hasten(0, kStart);
  schedule.Restart(0, kStart);
  EXPECT_FALSE(schedule.Next(kStart + 1h));
  EXPECT_FALSE(schedule.NextDue());
  EXPECT_EQ(schedule.Missed(0, kStart + 1h), 0U);
  schedule.ReleaseEvents(0, true, Brought::something_else, kStart + 1h);
  EXPECT_EQ(schedule.Next(kStart + 1h)->query, kEventsQuery);
}

TEST(Schedule, EventsWithoutNewsWaitForTheNextPeriod) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {}, true);
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  schedule.HoldEvents(0);
  schedule.ReleaseEvents(0, true, Brought::no_news, kStart + 100ms);
  EXPECT_EQ(schedule.NextDue(), kStart + 1100ms);
}

TEST(Schedule, GroupsHaveTheirOwnPeriods) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 10s), {Group::fast, Group::slow});
  schedule.Restart(0, kStart);
  std::map<Group, int> count;
  for (Instant now = kStart; now < kStart + 60s; now += 100ms) {
    while (const auto pick = schedule.Next(now)) ++count[pick->group];
  }
  EXPECT_EQ(count[Group::fast], 60);
  EXPECT_EQ(count[Group::slow], 6);
}

TEST(Schedule, MissedPeriodsAreCountedAndNotQueued) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  ASSERT_TRUE(schedule.Next(kStart + 5500ms)) << "due since 1 s";
  EXPECT_EQ(schedule.Missed(0, kStart), 4U) << "2, 3, 4 and 5 s";
  EXPECT_FALSE(schedule.Next(kStart + 5500ms)) << "one poll makes up for all of them";
  EXPECT_EQ(schedule.NextDue(), kStart + 6s);
}

TEST(Schedule, ARoundThatRunsBeyondItsPeriodIsFollowedByTheNextAtOnce) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast, Group::fast});
  schedule.Restart(0, kStart);
  ASSERT_EQ(schedule.Next(kStart)->query, 0U);
  ASSERT_EQ(schedule.Next(kStart + 1200ms)->query, 1U) << "the round goes on where it was";
  ASSERT_EQ(schedule.Next(kStart + 1300ms)->query, 0U) << "late, but within its period";
  EXPECT_EQ(schedule.Missed(0, kStart), 0U);
  ASSERT_EQ(schedule.Next(kStart + 3100ms)->query, 1U);
  ASSERT_EQ(schedule.Next(kStart + 3100ms)->query, 0U) << "that of 3 s";
  EXPECT_EQ(schedule.Missed(0, kStart), 1U) << "that of 2 s passed whole";
}

TEST(Schedule, DevicesTakeTurns) {
  Schedule schedule;
  for (int device = 0; device < 3; ++device) {
    schedule.SetQueries(schedule.AddDevice(1s, 1min), std::vector<Group>(4, Group::fast));
  }
  for (std::size_t device = 0; device < 3; ++device) schedule.Restart(device, kStart);
  std::vector<std::size_t> order;
  while (const auto pick = schedule.Next(kStart)) order.push_back(pick->device);
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2}));
}

TEST(Schedule, SuspendedDeviceIsSilentAndRestartsWithAWholeRound) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast, Group::fast});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  schedule.Suspend(0);
  EXPECT_FALSE(schedule.Next(kStart + 10s));
  EXPECT_FALSE(schedule.NextDue());
  EXPECT_EQ(schedule.Missed(0, kStart + 10s), 0U);
  schedule.Restart(0, kStart + 20s);
  EXPECT_EQ(schedule.Next(kStart + 20s)->query, 0U);
  EXPECT_EQ(schedule.Missed(0, kStart), 0U) << "periods while offline were not missed by the line";
}

TEST(Schedule, ADueRoundGoesBeforeTheNextWrite) {
  Schedule schedule;
  const std::size_t device = schedule.AddDevice(1s, 1h);
  schedule.SetQueries(device, {Group::fast, Group::fast});
  schedule.Restart(device, Instant());
  EXPECT_FALSE(schedule.GoesFirst(device, Instant())) << "no write has failed";
  schedule.GoFirst(device);
  EXPECT_TRUE(schedule.GoesFirst(device, Instant()));
  schedule.Next(Instant());
  EXPECT_TRUE(schedule.GoesFirst(device, Instant())) << "one of two queries";
  schedule.Next(Instant());
  EXPECT_FALSE(schedule.GoesFirst(device, Instant() + 1s)) << "the next round does not";
  schedule.GoFirst(device);
  EXPECT_FALSE(schedule.GoesFirst(device, Instant() + 500ms)) << "none is due";
  schedule.Hold(device, Instant() + 5s);
  EXPECT_FALSE(schedule.GoesFirst(device, Instant() + 1s)) << "it waits, the write need not";
}

TEST(Schedule, AHeldDeviceWaitsAndOtherDevicesContinue) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
  schedule.Restart(0, kStart);
  schedule.Restart(1, kStart);
  schedule.Hold(0, kStart + 300ms);
  schedule.Hold(0, kStart + 100ms);
  EXPECT_EQ(schedule.Next(kStart)->device, 1U);
  EXPECT_FALSE(schedule.Next(kStart + 299ms));
  EXPECT_EQ(schedule.NextDue(), kStart + 300ms);
  EXPECT_EQ(schedule.Next(kStart + 300ms)->device, 0U);
}

TEST(Schedule, ReleaseEndsAHold) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
  schedule.Restart(0, kStart);
  schedule.Hold(0, kStart + 1h);
  EXPECT_FALSE(schedule.Next(kStart + 1min));
  schedule.Release(0);
  EXPECT_EQ(schedule.Next(kStart + 1min)->device, 0U);
}

TEST(Schedule, NewQueriesEndTheRound) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast, Group::fast});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  schedule.SetQueries(0, {Group::fast});
  EXPECT_FALSE(schedule.Next(kStart + 1ms));
  EXPECT_EQ(schedule.Next(kStart + 1s)->query, 0U);
  schedule.SetQueries(0, {});
  EXPECT_FALSE(schedule.NextDue());
}

TEST(Schedule, NoDeviceStarvesWhateverThePeriods) {
  std::mt19937 random(4711);
  for (int round = 0; round < 60; ++round) {
    Schedule schedule;
    const std::size_t devices = 1 + random() % 12;
    const Duration cost = std::chrono::microseconds(100 + random() % 200'000);
    std::vector<Duration> longest(devices);
    for (std::size_t device = 0; device < devices; ++device) {
      const auto fast = std::chrono::milliseconds(1 + random() % 2000);
      schedule.AddDevice(fast, std::chrono::milliseconds(1 + random() % 20000));
      std::vector<Group> groups(1 + random() % 5);
      for (Group& group : groups) group = static_cast<Group>(random() % 3);
      groups.front() = Group::fast;
      schedule.SetQueries(device, groups);
      schedule.Restart(device, kStart);
      longest[device] = fast + static_cast<std::int64_t>(3 * devices + 1) * cost;
    }
    std::vector<Instant> served(devices, kStart);
    Instant now = kStart;
    for (int step = 0; step < 3000; ++step) {
      const auto due = schedule.NextDue();
      ASSERT_TRUE(due);
      const auto pick = schedule.Next(now);
      ASSERT_EQ(pick.has_value(), *due <= now);
      for (std::size_t device = 0; device < devices; ++device) {
        ASSERT_LE(now - served[device], longest[device]) << device << " of " << devices;
      }
      if (pick) served[pick->device] = now;
      now = pick ? now + cost : *due;
    }
  }
}

TEST(Schedule, ARestartDoesNotEndAHold) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
  schedule.Hold(0, kStart + 5min);
  schedule.Restart(0, kStart);
  EXPECT_FALSE(schedule.Next(kStart + 4min));
  EXPECT_TRUE(schedule.Next(kStart + 5min));
}

TEST(Schedule, AHastenedDeviceIsReadAtOnceButNotAfterEachOfManyWrites) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1min, 1min), {Group::fast, Group::once});
  schedule.Restart(0, kStart);
  while (schedule.Next(kStart)) {
  }
  int picked = 0;
  std::optional<Instant> last;
  for (Instant now = kStart + 1s; now < kStart + 31s; now += 10ms) {
    schedule.Hasten(0, now);
    while (schedule.Next(now)) {
      ++picked;
      last = now;
    }
    if (now == kStart + 1s) {
      EXPECT_EQ(picked, 2) << "at once";
    }
  }
  EXPECT_LE(picked, 12) << "two queries, at most twice in 10 s";
  EXPECT_GE(picked, 6);
  schedule.Hasten(0, kStart + 31s);
  EXPECT_LE(*schedule.NextDue(), *last + 10s) << "the last write is followed by a reading";
}

TEST(Schedule, TheSecondHasteWaitsForTenSecondsAndNoneEndsABackOff) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1h, 1h), {Group::fast, Group::slow});
  schedule.Restart(0, kStart);
  const auto poll = [&](Instant now) {
    while (schedule.Next(now)) {
    }
  };
  poll(kStart);
  schedule.Hasten(0, kStart + 1s);
  EXPECT_EQ(schedule.NextDue(), kStart + 1s);
  poll(kStart + 1s);
  schedule.Hasten(0, kStart + 2s);
  EXPECT_EQ(schedule.NextDue(), kStart + 11s);
  poll(kStart + 11s);
  schedule.RepeatSoon(0, Group::slow, kStart + 11s, 1min);
  schedule.Hasten(0, kStart + 12s);
  EXPECT_EQ(schedule.Next(kStart + 12s)->group, Group::fast);
  EXPECT_EQ(schedule.NextDue(), kStart + 19s);
}

TEST(Schedule, AOnceQueryIsRequestedOnceUntilRestart) {
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

TEST(Schedule, AOnceQueryIsRepeatedOnRequest) {
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

TEST(Schedule, ANewPlanContinuesWithUnreadOnceQueries) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::once, Group::once});
  schedule.SetQueries(schedule.AddDevice(1s, 1min), {Group::fast});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  const auto plan = [&](std::size_t queries) {
    schedule.SetQueries(0, std::vector(queries, Group::once));
    schedule.GoOn(0, kStart);
  };
  plan(1);
  EXPECT_TRUE(schedule.Next(kStart)) << "what has become of the latest one";
  EXPECT_FALSE(schedule.Next(kStart));
  schedule.Restart(1, kStart);
  ASSERT_EQ(schedule.Next(kStart)->device, 1U);
  plan(1);
  EXPECT_FALSE(schedule.Next(kStart)) << "all had been asked for";
  plan(2);
  const auto more = schedule.Next(kStart);
  ASSERT_TRUE(more) << "there are more of them";
  EXPECT_EQ(more->query, 0U);
}

TEST(Schedule, ADailyQueryIsRequestedAtTheStartAndThenOnceADay) {
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

TEST(Schedule, AFailedDailyQueryIsRepeatedOnceAndRestartsTheDay) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h), {Group::daily});
  schedule.Restart(0, kStart);
  ASSERT_TRUE(schedule.Next(kStart));
  schedule.Repeat(0, Group::daily, kStart + 1h);
  schedule.Repeat(0, Group::daily, kStart + 1min);
  EXPECT_FALSE(schedule.Next(kStart + 59min));
  EXPECT_TRUE(schedule.Next(kStart + 1h));
  EXPECT_FALSE(schedule.Next(kStart + 24h));
  EXPECT_TRUE(schedule.Next(kStart + 25h));
}

TEST(Schedule, ANewPlanSkipsNoDailyQuery) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h), std::vector(4, Group::daily));
  schedule.Restart(0, kStart);
  ASSERT_EQ(schedule.Next(kStart)->query, 0U);
  ASSERT_EQ(schedule.Next(kStart)->query, 1U);
  schedule.SetQueries(0, std::vector(3, Group::daily));
  schedule.RestartAsPlanned(0, kStart);
  ASSERT_EQ(schedule.Next(kStart)->query, 1U);
  schedule.SetQueries(0, std::vector(5, Group::daily));
  schedule.RestartAsPlanned(0, kStart);
  for (std::size_t query = 0; query < 5; ++query) EXPECT_EQ(schedule.Next(kStart)->query, query);
  EXPECT_FALSE(schedule.Next(kStart + 23h));
  EXPECT_TRUE(schedule.Next(kStart + 24h));
  EXPECT_EQ(schedule.Missed(0, kStart + 24h), 0U);
}

TEST(Schedule, ARestartAsPlannedContinuesTheDailyRound) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h), std::vector(3, Group::daily));
  schedule.Restart(0, kStart);
  ASSERT_EQ(schedule.Next(kStart)->query, 0U);
  schedule.SetQueries(0, std::vector(2, Group::daily));
  schedule.RestartAsPlanned(0, kStart);
  EXPECT_EQ(schedule.Next(kStart)->query, 0U);
  EXPECT_EQ(schedule.Next(kStart)->query, 1U);
  EXPECT_FALSE(schedule.Next(kStart));
  schedule.SetQueries(0, std::vector(2, Group::daily));
  schedule.RestartAsPlanned(0, kStart + 9h);
  EXPECT_EQ(schedule.Next(kStart + 9h)->query, 0U);
}

TEST(Schedule, ANewPlanContinuesTheRoundInProgress) {
  Schedule schedule;
  schedule.SetQueries(schedule.AddDevice(1s, 1min, 24h),
                      {Group::fast, Group::fast, Group::slow, Group::once});
  schedule.Restart(0, kStart);
  const auto next = [&](Instant now) {
    const auto pick = schedule.Next(now);
    return pick ? std::optional(pick->query) : std::nullopt;
  };
  for (int i = 0; i < 3; ++i) next(kStart);
  ASSERT_EQ(next(kStart), 1U);
  schedule.SetQueries(0, {Group::fast, Group::fast, Group::fast, Group::slow, Group::once});
  schedule.GoOn(0, kStart);
  EXPECT_EQ(next(kStart), 1U);
  EXPECT_EQ(next(kStart), 2U);
  EXPECT_EQ(next(kStart), std::nullopt) << "neither the slow one nor that which is read once";
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

TEST(Schedule, ANewPlanContinuesSlowAndDailyRounds) {
  const struct {
    Group group;
    // Number of queries in the new plan; in the old plan one of three queries had been read.
    std::size_t now;
    std::vector<std::size_t> asked;
  } kRows[] = {{Group::slow, 3, {2, 3}},
               {Group::slow, 2, {2}},
               {Group::daily, 3, {2, 3}},
               {Group::daily, 2, {1, 2}},
               {Group::daily, 4, {1, 2, 3, 4}}};
  for (const auto& row : kRows) {
    SCOPED_TRACE(row.now);
    Schedule schedule;
    const auto plan = [&](std::size_t queries) {
      std::vector<Group> groups(queries + 1, row.group);
      groups.front() = Group::fast;
      schedule.SetQueries(0, groups);
    };
    schedule.AddDevice(1s, 1h);
    plan(3);
    schedule.Restart(0, kStart);
    ASSERT_EQ(schedule.Next(kStart)->query, 1U);
    ASSERT_EQ(schedule.Next(kStart)->query, 0U);
    plan(row.now);
    schedule.GoOn(0, kStart);
    std::vector<std::size_t> asked;
    while (const auto pick = schedule.Next(kStart)) {
      if (pick->group == row.group) asked.push_back(pick->query);
    }
    EXPECT_EQ(asked, row.asked);
  }
}

TEST(Schedule, AGroupWithoutQueriesMissesNoPeriods) {
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
}  // namespace baudgate::bus
