// What is said of missed periods: a full line, a device that fails itself, or its neighbour.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "tests/gateway/status/diagnose_fixture.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST_F(DiagnoseTest, MissedPeriods) {
  device().missed = 100;  // of the 10,800 in three hours: not one in a hundred
  EXPECT_THAT(Say(), IsEmpty());
  device().missed = 1296;
  EXPECT_THAT(Say(), ElementsAre("missed 12 % of its periods since the start (1296): a round takes "
                                 "longer than its period, or failures took the time; if the count "
                                 "grows, raise poll, ask for fewer points, or raise the bit rate"));
  EXPECT_THAT(SayOfLine(), IsEmpty());
  line_.use = 0.98;
  EXPECT_THAT(Say(), ElementsAre("missed 12 % of its periods since the start (1296): the line is "
                                 "full (use 98 %); raise poll, ask for fewer points, or raise the "
                                 "bit rate"));
  EXPECT_THAT(SayOfLine(), ElementsAre("full (use 98 %): more is asked than fits: raise poll, ask "
                                       "for fewer points, or raise the bit rate"));
  device().missed = 0;
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "a line that is full and misses nothing is well used";
}

/// 1296 periods of feeder-2 are missed on a full line, and feeder-1 beside it is as each test says.
class MissedBesideTest : public DiagnoseTest {
 protected:
  MissedBesideTest() {
    line_.use = 0.96;
    device().missed = 1296;
    device().busy = 40s;
    for (int i = 0; i < 1000; ++i) device().round_trips.Add(38ms);
    neighbour_.status.exchanges = 1000;
  }
  void NeighbourEnds(Outcome outcome, int count) {
    for (int i = 0; i < count; ++i) neighbour_.status.recent.Add(outcome);
  }
};

TEST_F(MissedBesideTest, ANeighbourThatFailsIsNamedWithItsPartOfTheTime) {
  NeighbourEnds(Outcome::ok, 24);
  NeighbourEnds(Outcome::no_reply, 40);
  for (int i = 0; i < 100; ++i) neighbour_.status.round_trips.Add(50ms);
  neighbour_.status.busy = 60s;  // 55 of them in vain
  const std::string cause =
      "feeder-1 has taken 55 % of the line's time with exchanges that fail (40 of its last 64): "
      "mend that first";
  EXPECT_THAT(Say(), ElementsAre("missed 12 % of its periods since the start (1296): " + cause));
  EXPECT_THAT(SayOfLine(), ElementsAre("full (use 96 %): " + cause));
}

TEST_F(MissedBesideTest, ANeighbourThatBeganToFailLatelyIsNamedWithoutAPart) {
  NeighbourEnds(Outcome::ok, 54);
  NeighbourEnds(Outcome::corrupt, 10);
  neighbour_.status.busy = 8s;
  EXPECT_THAT(Say(), ElementsAre("missed 12 % of its periods since the start (1296): feeder-1 "
                                 "fails in 10 of its last 64 exchanges: mend that first, then "
                                 "raise poll, ask for fewer points, or raise the bit rate"));
}

TEST_F(MissedBesideTest, AnAbsentNeighbourIsNamedFromANotablePartOn) {
  neighbour_.status.state = DeviceState::offline;
  neighbour_.status.busy = 4s;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("the line is full"));
  neighbour_.status.busy = 10s;
  EXPECT_THAT(Say()[0],
              ::testing::EndsWith("(1296): feeder-1 does not answer and has taken 20 % of "
                                  "the line's time: mend that first, then raise poll, ask "
                                  "for fewer points, or raise the bit rate"));
  neighbour_.status.busy = 60s;
  EXPECT_THAT(Say()[0],
              ::testing::EndsWith("(1296): feeder-1 does not answer and has taken 60 % of "
                                  "the line's time: mend that first"));
  neighbour_.status.state = DeviceState::disabled;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("the line is full"));
}

TEST_F(MissedBesideTest, OneThatAnswersNowAndThenIsNamedBeforeAnAbsentOne) {
  DeviceRecord failing = neighbour_;
  for (int i = 0; i < 32; ++i) failing.status.recent.Add(Outcome::no_reply);
  neighbour_.status.state = DeviceState::offline;
  neighbour_.status.busy = 60s;
  const DeviceRecord orders[][2] = {{failing, neighbour_}, {neighbour_, failing}};
  for (const auto& records : orders) {
    const LineDevices seen = LookAt(records, kNow, kStarted);
    ASSERT_NE(seen.wasteful, nullptr);
    EXPECT_EQ(seen.wasteful->status.state, DeviceState::online);
  }
}

TEST_F(MissedBesideTest, ADeviceThatFailsItselfIsIt) {
  device().busy = 100s;
  Ended(Outcome::partial, 64);
  EXPECT_THAT(Say(),
              ElementsAre(::testing::StartsWith("partial in "),
                          ::testing::EndsWith("(1296): it has taken 62 % of the line's time "
                                              "with exchanges that fail (64 of its last 64): "
                                              "mend that first")));
}

TEST_F(MissedBesideTest, ANeighbourThatHasRecoveredIsNotNamed) {
  NeighbourEnds(Outcome::no_reply, 64);
  NeighbourEnds(Outcome::ok, 57);
  neighbour_.status.busy = 60s;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("the line is full"));
}

}  // namespace
}  // namespace baudgate::control
