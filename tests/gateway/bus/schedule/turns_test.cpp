// Tests of `Turns`, `Round`, `IdleTime`, `Background` and `EventDelivery`.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/turns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/bus/jobs/intake.h"
#include "gateway/bus/schedule/schedule.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

using Choice = Turns::Choice;
using ::testing::ElementsAre;

/// Returns the first `count` choices of `turns`. Each choice in `has` always has something to send;
/// other choices never have.
std::vector<Choice> Play(Turns& turns, const Turns::Waiting& waiting,
                         const std::vector<Choice>& has, std::size_t count) {
  std::vector<Choice> taken;
  while (taken.size() < count) {
    bool any = false;
    for (const Choice choice : turns.Order(waiting)) {
      if (std::ranges::find(has, choice) == has.end()) continue;
      turns.OnTaken(choice, waiting);
      turns.OnSent(choice == Choice::urgent);
      taken.push_back(choice);
      any = true;
      break;
    }
    if (!any) break;
  }
  return taken;
}

TEST(Turns, AfterFourWritesInARowAPollHasItsTurn) {
  Turns turns;
  const auto taken = Play(turns, {}, {Choice::urgent, Choice::poll}, 6);
  EXPECT_THAT(taken, ElementsAre(Choice::urgent, Choice::urgent, Choice::urgent, Choice::urgent,
                                 Choice::poll, Choice::urgent));
}

TEST(Turns, AfterSixteenRoutedShortWritesAnotherRequestHasItsTurn) {
  Turns turns;
  const auto taken = Play(turns, {.short_write = true, .routed = true},
                          {Choice::urgent, Choice::routed_normal}, 18);
  EXPECT_EQ(std::ranges::count(taken, Choice::urgent), 17);
  EXPECT_EQ(taken[16], Choice::routed_normal);
}

TEST(Turns, WritesContinueWhenNothingElseWaits) {
  Turns turns;
  EXPECT_EQ(Play(turns, {}, {Choice::urgent}, 9).size(), 9U);
}

TEST(Turns, TheCountRestartsWhenNothingWaits) {
  Turns turns;
  Play(turns, {}, {Choice::urgent}, 4);
  EXPECT_FALSE(turns.UrgentAllowed(false));
  EXPECT_TRUE(turns.UrgentAllowed(true));
  turns.OnNothing();
  EXPECT_TRUE(turns.UrgentAllowed(false));
  const Turns::Waiting waiting{.routed = true, .high_clients = 1};
  Play(turns, waiting, {Choice::routed_high}, 1);
  turns.OnNothing();
  EXPECT_THAT(Play(turns, waiting, {Choice::routed_high, Choice::routed_normal}, 2),
              ElementsAre(Choice::routed_high, Choice::routed_normal));
}

TEST(Turns, PollsAndRoutedRequestsAlternate) {
  Turns turns;
  const auto taken =
      Play(turns, {.routed = true}, {Choice::poll, Choice::routed_normal, Choice::routed_low}, 4);
  EXPECT_THAT(
      taken, ElementsAre(Choice::routed_normal, Choice::poll, Choice::routed_normal, Choice::poll));
}

TEST(Turns, AnotherRequestFollowsEachTurnOfTheHighPriorityClients) {
  Turns turns;
  const auto taken = Play(turns, {.routed = true, .high_clients = 2},
                          {Choice::poll, Choice::routed_high, Choice::routed_normal}, 6);
  EXPECT_THAT(taken, ElementsAre(Choice::routed_high, Choice::routed_high, Choice::routed_normal,
                                 Choice::routed_high, Choice::routed_high, Choice::poll));
}

TEST(Turns, LowPriorityComesLast) {
  Turns turns;
  EXPECT_EQ(turns.Order({.routed = true}).back(), Choice::routed_low);
}

struct Spell {
  Duration passed;
  bool failing;
  bool healthy_first;
};

TEST(Turns, HealthyDevicesGetBackTheTimeOfFailingDevices) {
  Turns turns;
  const Spell spells[] = {
      {1s, false, false}, {3s, true, true},   {2s, false, true},  {1s, false, false},
      {1h, true, true},   {59s, false, true}, {1s, false, false},
  };
  for (const Spell& spell : spells) {
    turns.OnTime(spell.passed, spell.failing);
    EXPECT_EQ(turns.HealthyFirst(), spell.healthy_first) << FormatDuration(spell.passed);
  }
  turns.Charge(500ms);
  EXPECT_TRUE(turns.HealthyFirst()) << "the first failure counts, too";
}

TEST(Round, BeginsOnItsGridAndSkipsPeriodsThatHavePassedWhole) {
  const struct {
    const char* what;
    Duration period;
    Duration begun;
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

TEST(Round, IsRepeatedOnceAndOnlyEarlier) {
  Round round{.queries = {7}, .period = 24h, .due = kStart + 10s, .cursor = 1};
  round.Repeat(kStart + 20s);
  EXPECT_EQ(round.due, kStart + 10s);
  round.Repeat(kStart + 5s);
  round.Repeat(kStart + 1s);
  EXPECT_EQ(round.due, kStart + 5s);
}

class IdleTimeTest : public ::testing::Test {
 protected:
  /// Handles one input at `at`. `before` and `after`: the line is idle before and after the input.
  Duration Input(Duration at, bool before, bool after) {
    const Duration passed = time_.OnInput({kStart + at, kWall + at}, before);
    time_.OnHandled(after);
    return passed;
  }
  Duration Since() const { return time_.idle().since - kStart; }

  IdleTime time_;
};

TEST_F(IdleTimeTest, BeginsWithTheInputThatMadeTheLineIdle) {
  Input(1s, false, false);
  EXPECT_EQ(Input(3s, false, true), 2s);
  EXPECT_EQ(Since(), 3s);
  EXPECT_EQ(Input(8s, true, true), 5s);
  EXPECT_EQ(Since(), 3s) << "it is idle still";
  EXPECT_EQ(time_.idle().now, kStart + 8s);
  Input(9s, true, false);
  Input(10s, false, true);
  EXPECT_EQ(Since(), 10s);
}

TEST_F(IdleTimeTest, RestartsWhenTheLineResumes) {
  Input(1s, false, true);
  Input(5s, true, true);
  time_.Restart();
  EXPECT_EQ(Since(), 5s);
}

// ---------------- Reads that can wait are sent in gaps where they delay no poll.

using Which = Background::Which;

constexpr Duration kRoom = 400ms;

struct FakeLine {
  FakeLine() {
    for (int i = 0; i < 2; ++i) {
      schedule.SetQueries(schedule.AddDevice(1s, 1min), {config::Group::fast});
      schedule.Restart(static_cast<std::size_t>(i), kStart);
    }
  }
  void Poll(Instant now) {
    while (schedule.Next(now)) {
    }
  }
  Schedule schedule;
  Background background{schedule};
};

TEST(Background, RunsIfItEndsBeforeTheNextPoll) {
  FakeLine line;
  line.background.Set(1, kStart, kRoom);
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart)) << "polls are due";
  line.Poll(kStart);
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart + 600ms), 1U);
  EXPECT_EQ(line.background.NextAt(kStart + 600ms), kStart + 600ms);
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 601ms));
  EXPECT_FALSE(line.background.Next(Which::that_starves, kStart + 601ms));
  EXPECT_EQ(line.background.NextAt(kStart + 601ms), kStart + 1min) << "the next poll ends the wait";
}

TEST(Background, TheRoomFollowsFromTheLatestExchanges) {
  FakeLine line;
  line.background.Set(0, kStart, kRoom);
  line.Poll(kStart);
  for (int i = 0; i < 8; ++i) {
    EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 800ms)) << "too few to know";
    line.background.NoteEnd(0, i == 3 ? 100ms : 20ms);
  }
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart + 800ms), 0U);
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 801ms));
  line.background.NoteEnd(0, Duration::zero());
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 800ms));
}

TEST(Background, TheRoomIsHalfAsMuchAgainAsTheLongestExchangeWithinLimits) {
  const struct {
    std::vector<Duration> took;
    Duration room;
  } kRows[] = {{std::vector<Duration>(8, 100ms), 200ms},
               {std::vector<Duration>(8, 200ms), 300ms},
               {std::vector<Duration>(8, 390ms), 400ms}};
  for (const auto& row : kRows) {
    SCOPED_TRACE(FormatDuration(row.took.front()));
    FakeLine line;
    line.background.Set(0, kStart, kRoom);
    line.Poll(kStart);
    for (const Duration took : row.took) line.background.NoteEnd(0, took);
    EXPECT_TRUE(line.background.HasRoom(0, kStart + 1s - row.room));
    EXPECT_FALSE(line.background.HasRoom(0, kStart + 1s - row.room + 1ns));
  }
}

TEST(Background, ALongExchangeIsForgottenSlowly) {
  FakeLine line;
  line.background.Set(0, kStart, kRoom);
  line.Poll(kStart);
  line.background.NoteEnd(0, 240ms);
  // 240 ms times (63/64)^32: 153 ms remain.
  for (int i = 0; i < 32; ++i) line.background.NoteEnd(0, 20ms);
  EXPECT_TRUE(line.background.HasRoom(0, kStart + 1s - 230ms));
  EXPECT_FALSE(line.background.HasRoom(0, kStart + 1s - 228ms));
}

TEST(Background, AnUnsentTaskHasNoSecondTurnAtTheSameTime) {
  FakeLine line;
  line.background.Set(0, kStart, kRoom);
  line.Poll(kStart);
  line.background.OnTaken(0, kStart + 100ms);
  line.background.OnUnsent(0);
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 100ms));
  line.Poll(kStart + 1s);
  EXPECT_EQ(line.background.NextAt(kStart + 1s), kStart + 1100ms);
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart + 1100ms), 0U);
  line.background.OnTaken(0, kStart + 1100ms);
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart + 1100ms), 0U) << "this one was sent";
}

TEST(Background, AProofIsSentWithAnExchangeWhenThereIsRoomForBoth) {
  FakeLine line;
  line.background.Set(0, kStart, kRoom);
  line.Poll(kStart);
  for (int i = 0; i < Background::kFew; ++i) line.background.NoteEnd(0, 100ms);
  line.background.SetProof(0, kStart, kStart + 300ms);
  EXPECT_TRUE(line.background.MayProve(0, kStart + 200ms)) << "twice the room, as nobody knows";
  EXPECT_FALSE(line.background.MayProve(0, kStart + 201ms));
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart + 299ms), 0U) << "without it";
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 300ms)) << "it has to";
  line.background.NoteEnd(0, 200ms, true);
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart + 700ms), 0U);
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 701ms));
  line.background.SetProof(0, kStart + 750ms, kStart + 1min);
  EXPECT_FALSE(line.background.MayProve(0, kStart + 700ms)) << "it is too young";
}

TEST(Background, RunsOnceAMinuteOnALineThatIsNeverIdle) {
  FakeLine line;
  line.background.Set(0, kStart, 2s);
  EXPECT_FALSE(line.background.Next(Which::that_starves, kStart + 59s));
  EXPECT_EQ(line.background.Next(Which::that_starves, kStart + 60s), 0U);
  line.background.OnTaken(0, kStart + 60s);
  EXPECT_FALSE(line.background.Next(Which::that_starves, kStart + 119s));
  EXPECT_EQ(line.background.Next(Which::that_starves, kStart + 120s), 0U);
}

TEST(Background, DevicesTakeTurns) {
  FakeLine line;
  line.background.Set(0, kStart, kRoom);
  line.background.Set(1, kStart, kRoom);
  line.Poll(kStart);
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart), 0U);
  line.background.OnTaken(0, kStart);
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart), 1U);
  line.background.OnTaken(1, kStart);
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart), 0U);
}

TEST(Background, WaitsForTheDiskAndForAnAbsentDevice) {
  FakeLine line;
  line.background.Set(0, kStart, kRoom);
  line.Poll(kStart);
  line.background.AwaitDisk(0);
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart));
  EXPECT_FALSE(line.background.NextAt(kStart));
  line.background.Release(0);
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart), 0U);
  line.schedule.Hold(0, kStart + 100ms);
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart));
  EXPECT_EQ(line.background.NextAt(kStart), kStart + 100ms);
  line.schedule.Suspend(0);
  EXPECT_FALSE(line.background.NextAt(kStart));
  line.background.Set(0, std::nullopt, kRoom);
  EXPECT_FALSE(line.background.NextAt(kStart));
}

class EventDeliveryTest : public ::testing::Test, protected ToyMembers {
 protected:
  static protocols::EventBatch Batch(std::size_t events, bool drained = false) {
    protocols::EventBatch batch;
    batch.events.resize(events);
    batch.drained = drained;
    return batch;
  }
  static EventDelivery::Exchange At(Duration asked, bool background = false) {
    const Duration answered = asked + 100ms;
    return {kStart + asked, {kStart + answered, kWall + answered}, background};
  }

  EventDelivery told_;
};

TEST_F(EventDeliveryTest, EventsAreNoOlderThanTheLastDrain) {
  struct Row {
    const char* what;
    Duration asked;
    std::size_t events;
    bool drained;
    bool kept;
    std::optional<Duration> oldest;
  };
  const Row kRows[] = {
      {"nobody knows when it was empty", 1s, 2, false, true, std::nullopt},
      {"nothing is left", 2s, 0, true, false, std::nullopt},
      {"since then", 5s, 1, false, true, 3100ms},
      {"and still", 6s, 1, false, true, 4100ms},
      {"nothing is said, and something may be left", 7s, 0, false, false, std::nullopt},
      {"the last ones: the device has looked since it was asked", 8s, 1, true, true, 100ms},
      {"since the last ones", 9s, 1, false, true, 1100ms},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.what);
    const auto events = told_.Take(a, Batch(row.events, row.drained), At(row.asked));
    ASSERT_EQ(events.has_value(), row.kept);
    if (!events) continue;
    EXPECT_EQ(events->device, a.index);
    EXPECT_EQ(events->batch.events.size(), row.events);
    EXPECT_EQ(events->received.instant, kStart + row.asked + 100ms);
    EXPECT_EQ(events->received.wall, kWall + row.asked + 100ms);
    EXPECT_EQ(events->oldest, row.oldest);
  }
}

TEST_F(EventDeliveryTest, ABatchOfPastRecordsIsDelivered) {
  protocols::EventBatch batch;
  batch.past.resize(1);
  EXPECT_TRUE(told_.Take(a, batch, At(1s)));
}

TEST_F(EventDeliveryTest, EachDeviceIsDrainedByItself) {
  told_.Take(a, Batch(0, true), At(1s));
  EXPECT_EQ(told_.Take(b, Batch(1), At(2s))->oldest, std::nullopt);
  EXPECT_EQ(told_.Take(a, Batch(1), At(2s))->oldest, 1100ms);
}

TEST_F(EventDeliveryTest, TheDrainTimeIsForgottenWhenADeviceIsReplaced) {
  told_.Take(a, Batch(0, true), At(1s));
  told_.OnReplaced(a);
  EXPECT_EQ(told_.Take(a, Batch(1), At(2s))->oldest, std::nullopt);
}

TEST_F(EventDeliveryTest, AStoredBatchReportsWhetherItBroughtNews) {
  using Brought = Schedule::Brought;
  struct Row {
    const char* what;
    bool background;
    const char* said;
    Brought brought;
  };
  const Row kRows[] = {
      {"the first one", false, "A", Brought::news},
      {"another one", false, "B", Brought::news},
      {"the same once more", false, "B", Brought::no_news},
      {"in the background", true, "C", Brought::something_else},
      {"the same once more, asked for", false, "C", Brought::no_news},
      {"the same once more, in the background", true, "C", Brought::something_else},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.what);
    told_.Take(a, Batch(1), At(1s, row.background));
    EXPECT_EQ(told_.OnKept(a, row.said), row.brought);
  }
}

TEST_F(EventDeliveryTest, ABatchStoredBeforeIsNoNewsWhenItComesAgain) {
  EXPECT_EQ(told_.OnKept(a, "A"), Schedule::Brought::news);
  told_.Take(a, Batch(1), At(1s));
  EXPECT_EQ(told_.OnKept(a, "A"), Schedule::Brought::no_news);
  EXPECT_EQ(told_.OnKept(b, "A"), Schedule::Brought::news) << "of another device";
}

}  // namespace
}  // namespace baudgate::bus
