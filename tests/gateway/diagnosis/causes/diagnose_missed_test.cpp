// What is said of polls for which there is no time: a full line, a slow device, one that fails.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "tests/gateway/diagnosis/causes/diagnose_fixture.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Polled every second, it has missed 60 of the 200 or so of the last minutes.
class MissedTest : public DiagnoseTest {
 protected:
  MissedTest() {
    line_.busy = kWatched;
    Minute().missed = 60;
    for (int i = 0; i < 1000; ++i) device().round_trips.Add(38ms);
    for (int i = 0; i < 1000; ++i) neighbour_.status.round_trips.Add(348ms);
  }
  MinuteCounts& Neighbours() { return neighbour_.status.hour.At(kNow.instant); }
  static constexpr Duration kWatched = 4min;
  const std::string missed_ = "missed 25 % of its polls in the last minutes: ";
};

TEST_F(MissedTest, AFewAreNoNews) {
  Minute().missed = 2;
  Minute().served = kWatched;
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(), IsEmpty());
}

TEST_F(MissedTest, GoodExchangesFillTheLine) {
  Minute().served = kWatched / 5;
  Neighbours().served = kWatched / 5;
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "something else keeps it from its polls";
  Minute().served = kWatched * 44 / 100;
  Neighbours().served = kWatched * 39 / 100;
  EXPECT_THAT(SayOfLine(), ElementsAre(::testing::HasSubstr("more is asked than fits")))
      << "both take as much";
  Neighbours().served = kWatched / 10;
  EXPECT_THAT(SayOfLine(),
              ElementsAre("polls are missed: feeder-2 takes 44 % of the line's time, 38 ms an "
                          "exchange: raise its poll, or ask for fewer points"));
  line_.busy = 4s;
  line_.bytes_in = 3000;
  EXPECT_THAT(SayOfLine(), ElementsAre(::testing::EndsWith("or raise the bit rate")))
      << "the characters take the time";
}

TEST_F(MissedTest, TheSilenceThatIsConfiguredIsNamed) {
  Minute().served = Neighbours().served = kWatched / 2;
  device().timing.quiet = neighbour_.status.timing.quiet = 400ms;
  EXPECT_THAT(SayOfLine(), ElementsAre(::testing::HasSubstr("lower timing.quiet (400ms)")));
  device().timing.quiet = 30ms;
  EXPECT_THAT(SayOfLine(), ElementsAre(::testing::HasSubstr("raise poll, ask for fewer points")));
}

TEST_F(MissedTest, TheDeviceWhoseTimeItIsIsNamed) {
  Minute().served = kWatched / 5;
  Neighbours().served = kWatched * 3 / 4;
  const std::string cause =
      "75 % of the line's time, 348 ms an exchange: raise its poll, or ask for fewer points";
  EXPECT_THAT(SayOfLine(), ElementsAre("polls are missed: feeder-1 takes " + cause));
  EXPECT_THAT(Say(), ElementsAre(missed_ + "feeder-1 takes " + cause));
}

TEST_F(MissedTest, ANeighbourThatFailsIsNamed) {
  Neighbours().wasted = kWatched / 2;
  EXPECT_THAT(Say(), IsEmpty()) << "what stands beside its good replies took the time";
  Looked(neighbour_.status, Symptom::damaged, 4);
  EXPECT_THAT(
      Say(),
      ElementsAre(
          missed_ +
          "feeder-1 takes 50 % of the line's time with exchanges that fail: mend that first"));
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "the sentence of feeder-1 says why";
}

TEST_F(MissedTest, ADeviceThatFailsItselfSaysWhyAndNoMore) {
  Minute().wasted = kWatched / 2;
  EXPECT_THAT(Say(), IsEmpty());
}

}  // namespace
}  // namespace baudgate::control
