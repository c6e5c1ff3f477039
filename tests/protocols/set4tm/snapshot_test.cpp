// Floats of one moment: the snapshot read of a SET-4TM meter.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "protocols/set4tm/conversation.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using ::testing::ElementsAre;

config::Device Snapshot() {
  config::Device device =
      MakeDevice("5", {MakePoint("08 1B 02 00 float_le@0"), MakePoint("08 1B 02 00 float_le@4"),
                       MakePoint("08 1B 02 20 float_le@4"), MakePoint("08 1B 00 34 float_le@0")});
  device.options.Set("snapshot", true);
  return device;
}

TEST(Set4tmSnapshotRead, MergesFloatsOfDifferentRequests) {
  Talk talk = OpenTalk(Snapshot());
  ASSERT_EQ(talk->Queries().size(), 2U);
  EXPECT_THAT(talk->Queries()[0].points, ElementsAre(0, 1, 2));
  const Answer answer = talk.Run(Poll(0), Script({"01 00 50 5A 44 C2 F5 D6 41 07 00 80 7F"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 23 01 00 00 00 00 00 02 00 00 03"));
  ASSERT_EQ(answer.readings.size(), 3U);
  EXPECT_EQ(std::get<double>(answer.readings[0].value), 873.25);
  EXPECT_NEAR(std::get<double>(answer.readings[1].value), 26.87, 0.001);
  EXPECT_EQ(answer.readings[2].quality, Quality::uncertain_last_usable);
}

TEST(Set4tmSnapshotRead, AnotherIdIsALateReply) {
  Talk talk = OpenTalk(Snapshot());
  const Answer answer = talk.Run(Poll(0), Script({"77 00 50 5A 44 C2 F5 D6 41 60 E5 A0 40"}));
  EXPECT_EQ(answer.outcome, Outcome::unexpected);
  EXPECT_TRUE(answer.readings.empty());
}

TEST(Set4tmSnapshotRead, FallsBackToGroupReads) {
  Talk talk = OpenTalk(Snapshot());
  const Answer answer = talk.Run(Poll(0), Script({"01"}));
  EXPECT_EQ(answer.then, Then::replan);
  EXPECT_TRUE(answer.readings.empty());
  EXPECT_EQ(talk->Queries().size(), 3U);
  talk.Run(Poll(0), Script({std::string("00 00 80 3F 00 00 80 3F 00 00 80 3F 00 00 80 3F")}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 23 01 00 00 00 00 00 02 00 00 03", "08 1B 02 00"));
}

TEST(Set4tmSnapshotRead, NeverAsksForMoreThan23Values) {
  config::Device device = MakeDevice("5", {});
  for (const char* rr : {"00", "04", "08", "30", "E0", "E4"}) {
    for (int slot = 0; slot < 4; ++slot) {
      device.points.push_back(
          MakePoint("08 1B 02 " + std::string(rr) + " float_le@" + std::to_string(4 * slot)));
    }
  }
  device.options.Set("snapshot", true);
  const MeterConversation conversation(device);
  ASSERT_EQ(conversation.Queries().size(), 2U);
  EXPECT_EQ(conversation.Queries()[0].points.size(), 23U);
  EXPECT_EQ(conversation.Queries()[1].points.size(), 1U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
