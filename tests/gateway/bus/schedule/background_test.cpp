// What can wait: it goes where it holds up no poll, and does not starve.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/schedule/schedule.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

using Which = Background::Which;

constexpr Duration kRoom = 400ms;

struct FakeLine {
  FakeLine() {
    for (int i = 0; i < 2; ++i) {
      schedule.SetQueries(schedule.AddDevice(1s, 1min), {config::Group::fast});
      schedule.Restart(static_cast<std::size_t>(i), kStart);
    }
  }
  /// All polls that are due.
  void Poll(Instant now) {
    while (schedule.Next(now)) {
    }
  }
  Schedule schedule;
  Background background{schedule};
};

TEST(Background, GoesWhereItIsThroughBeforeTheNextPoll) {
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

TEST(Background, WhatTheLatestExchangesTookIsRoomEnough) {
  FakeLine line;
  line.background.Set(0, kStart, kRoom);
  line.Poll(kStart);
  for (int i = 0; i < Background::kFew; ++i) {
    EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 800ms)) << "too few to know";
    line.background.NoteEnd(0, i == 3 ? 100ms : 20ms);
  }
  EXPECT_EQ(line.background.Next(Which::that_fits, kStart + 800ms), 0U);
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 801ms));
  line.background.NoteEnd(0, Duration::zero());
  EXPECT_FALSE(line.background.Next(Which::that_fits, kStart + 800ms));
}

TEST(Background, WhatCouldNotBeSentHasNoOtherTurnAtTheSameMoment) {
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

TEST(Background, AProofGoesWithAnExchangeWhereThereIsRoomForBoth) {
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

TEST(Background, ALineThatIsNeverIdleAsksOnceAMinute) {
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

TEST(Background, NothingIsAskedBeforeTheLastIsKeptNorOfADeviceThatIsAway) {
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

}  // namespace
}  // namespace baudgate
