// Tests of `RestingConnection` (which ends of a connection are an outage) and of `WriteGrace` (how
// long a port stays open for a write).
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/lines/line_port.h"
#include "gateway/lines/server_connection.h"
#include "tests/support/times.h"

namespace baudgate::lines {
namespace {

const Bytes kRequest = {1, 2, 3};

TEST(RestingConnection, OneConnectionForEachRequestIsGivenUpAgain) {
  RestingConnection rest(false);
  std::uint64_t answers = 0;
  rest.OnOpened(answers, kStart - 1s);
  EXPECT_FALSE(rest.Holds(kRequest, kStart));
  for (const int wanted : {32, 128, 512, 1024, 1024}) {
    rest.NoteBytes(kStart);
    EXPECT_FALSE(rest.Holds(kRequest, kStart));
    EXPECT_TRUE(rest.OnEnded(++answers, false, kStart)) << "in place of the second answer";
    int alone = 0;
    while (rest.Holds(kRequest, kStart)) {
      if (alone++ > 0) rest.NoteBytes(kStart);
      EXPECT_TRUE(rest.OnOpened(answers, kStart - 1s));
      EXPECT_EQ(rest.TakeHeld(), kRequest);
      ASSERT_LE(alone, 1024);
    }
    EXPECT_EQ(alone, wanted);
  }
}

TEST(RestingConnection, AnEndSoonAfterTheOpeningGivesEachRequestItsOwnConnection) {
  RestingConnection rest(false);
  rest.OnOpened(0, kStart);
  rest.Holds(kRequest, kStart);
  EXPECT_FALSE(rest.IsDrop(3, kStart + 30ms));
  EXPECT_TRUE(rest.OnEnded(3, false, kStart + 30ms));
  EXPECT_TRUE(rest.Holds(kRequest, kStart + 40ms));
  EXPECT_TRUE(rest.OnOpened(3, kStart + 41ms));
  EXPECT_EQ(rest.TakeHeld(), kRequest);
  rest.NoteBytes(kStart + 45ms);
  EXPECT_TRUE(rest.Holds(kRequest, kStart + 46ms)) << "each gets its own connection";
}

TEST(RestingConnection, AConnectionThatHasServedIsSharedAgain) {
  RestingConnection rest(false);
  rest.OnOpened(0, kStart - 1s);
  EXPECT_FALSE(rest.Holds(kRequest, kStart));
  EXPECT_TRUE(rest.OnEnded(100, false, kStart));
  EXPECT_TRUE(rest.Holds(kRequest, kStart)) << "it waits for the next connection";
  EXPECT_TRUE(rest.OnOpened(100, kStart - 1s));
  EXPECT_EQ(rest.TakeHeld(), kRequest);
  rest.NoteBytes(kStart);
  EXPECT_FALSE(rest.Holds(kRequest, kStart));
}

TEST(RestingConnection, FourUselessConnectionsAreNoOutageOnALineOfSeveralDevices) {
  for (const bool several : {false, true}) {
    RestingConnection rest(false);
    int rested = 0;
    for (;;) {
      rest.OnOpened(0, kStart - 1s);
      rest.Holds(kRequest, kStart);
      if (!rest.OnEnded(0, several, kStart)) break;
      ++rested;
    }
    EXPECT_EQ(rested, several ? 4 : 0);
  }
}

TEST(RestingConnection, AnEndAtTheSameRequestIsNeitherADropNorAnOutage) {
  RestingConnection rest(false, 2);
  rest.OnOpened(0, kStart - 1s);
  rest.Holds(kRequest, kStart);
  EXPECT_TRUE(rest.IsDrop(8, kStart));
  EXPECT_TRUE(rest.OnEnded(8, false, kStart));
  for (int again = 0; again < 4; ++again) {
    rest.OnOpened(8, kStart - 1s);
    EXPECT_FALSE(rest.Holds(Bytes{1, static_cast<std::uint8_t>(again), 3}, kStart));
    EXPECT_FALSE(rest.IsDrop(8, kStart));
    EXPECT_TRUE(rest.OnEnded(8, false, kStart));
  }
  rest.OnOpened(8, kStart - 1s);
  rest.Holds(kRequest, kStart);
  EXPECT_FALSE(rest.OnEnded(8, false, kStart)) << "it has served nothing else meanwhile";
}

TEST(RestingConnection, AnEndAtARequestAnsweredInAnotherConnectionIsADrop) {
  RestingConnection rest(false);
  rest.OnOpened(0, kStart - 1s);
  rest.Holds(kRequest, kStart);
  EXPECT_TRUE(rest.OnEnded(8, false, kStart));
  rest.OnOpened(8, kStart - 1s);
  rest.Holds(kRequest, kStart);
  rest.NoteBytes(kStart);
  rest.Holds(kRequest, kStart);
  EXPECT_TRUE(rest.IsDrop(16, kStart));
}

TEST(RestingConnection, TheEndOfAConnectionThatIsAlwaysWantedIsAnOutage) {
  RestingConnection rest(true);
  rest.OnOpened(0, kStart - 1s);
  rest.NoteBytes(kStart);
  EXPECT_FALSE(rest.OnEnded(1, true, kStart));
  EXPECT_FALSE(rest.rests());
}

TEST(RestingConnection, AnEndInUseIsADrop) {
  const struct {
    std::uint64_t answers;
    bool asks;
    Duration since;
    bool drops;
  } rows[] = {
      {1, false, 2ms, false},    // the server closes after each answer
      {8, false, 300ms, true},   // the connection ends between two requests
      {8, false, 20ms, true},    // the connection ends between two requests, soon after an answer
      {8, false, 500ms, false},  // the connection was idle for longer than ever before
      {8, false, 20s, false},
      {1, true, 2ms, false},    // the request was sent after the connection had ended
      {8, true, 2ms, true},     //
      {0, true, 300ms, false},  // the server never answers
  };
  for (const auto& row : rows) {
    RestingConnection rest(false);
    rest.OnOpened(100, kStart - 1s);
    rest.Holds(kRequest, kStart - 500ms);
    rest.NoteBytes(kStart - 450ms);
    rest.Holds(kRequest, kStart);
    if (!row.asks) rest.NoteBytes(kStart);
    EXPECT_EQ(rest.IsDrop(100 + row.answers, kStart + row.since), row.drops) << row.answers;
  }
}

TEST(WriteGraceTest, OnlyTheLastWaitingActionRunsAndRunsOnce) {
  std::string done;
  WriteGrace grace;
  EXPECT_FALSE(grace.waits());
  EXPECT_FALSE(grace.IsOver(kStart));
  grace.Begin([&] { done += "release "; }, kStart);
  grace.Begin([&] { done += "stop "; }, kStart + 500ms);
  EXPECT_TRUE(grace.waits());
  EXPECT_EQ(grace.until(), kStart + 1500ms);
  EXPECT_FALSE(grace.IsOver(kStart + 1499ms));
  EXPECT_TRUE(grace.IsOver(kStart + 1500ms));
  grace.End();
  EXPECT_EQ(done, "stop ");
  EXPECT_FALSE(grace.waits());
  EXPECT_FALSE(grace.IsOver(kStart + 1h));
}

TEST(WriteGraceTest, AnActionMayStartAnotherWait) {
  int ends = 0;
  WriteGrace grace;
  grace.Begin([&] { grace.Begin([&] { ++ends; }, kStart + 1s); }, kStart);
  grace.End();
  EXPECT_EQ(ends, 0);
  ASSERT_TRUE(grace.waits());
  grace.End();
  EXPECT_EQ(ends, 1);
}

}  // namespace
}  // namespace baudgate::lines
