// Floats of one moment: the snapshot read of a SET-4TM meter.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/plan.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using ::testing::ElementsAre;

config::Device SnapshotMeter() {
  config::Device device =
      MakeDevice("5", {MakePoint("08 1B 02 00 float_le@0"), MakePoint("08 1B 02 00 float_le@4"),
                       MakePoint("08 1B 02 20 float_le@4"), MakePoint("08 1B 00 34 float_le@0")});
  device.options.Set("snapshot", std::string("true"));
  return device;
}

TEST(Set4tmSnapshotRead, MergesFloatsOfDifferentRequests) {
  Talk talk = OpenTalk(SnapshotMeter());
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
  Talk talk = OpenTalk(SnapshotMeter());
  const Answer answer = talk.Run(Poll(0), Script({"77 00 50 5A 44 C2 F5 D6 41 60 E5 A0 40"}));
  EXPECT_EQ(answer.outcome, Outcome::unexpected);
  EXPECT_TRUE(answer.readings.empty());
}

TEST(Set4tmSnapshotRead, FallsBackToGroupReads) {
  Talk talk = OpenTalk(SnapshotMeter());
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
  device.options.Set("snapshot", std::string("true"));
  MeterBus bus;
  const MeterConversation conversation(device, ReadSettings(device.options), bus);
  ASSERT_EQ(conversation.Queries().size(), 2U);
  EXPECT_EQ(conversation.Queries()[0].points.size(), 23U);
  EXPECT_EQ(conversation.Queries()[1].points.size(), 1U);
}

config::Device Automatic() {
  config::Device device = SnapshotMeter();
  device.options.Set("snapshot", std::string("auto"));
  return device;
}

constexpr const char* kThree = "00 50 5A 44 C2 F5 D6 41 60 E5 A0 40";
constexpr const char* kGroup = "00 00 80 3F 00 00 80 3F 00 00 80 3F 00 00 80 3F";
constexpr const char* kMaskedRead = "08 23 01 00 00 00 00 00 02 00 00 03";

TEST(Set4tmSnapshotTrial, OneGoodAnswerAndAllIsReadSo) {
  Talk talk = OpenTalk(Automatic());
  ASSERT_EQ(talk->Queries().size(), 3U);
  const Answer answer = talk.Run(Poll(0), Script({std::string("01 ") + kThree}));
  EXPECT_EQ(answer.then, Then::restart);
  ASSERT_EQ(answer.readings.size(), 3U) << "and its values count";
  EXPECT_EQ(std::get<double>(answer.readings[0].value), 873.25);
  EXPECT_EQ(talk->Queries().size(), 2U);
  EXPECT_EQ(talk->WhatIsLearned(), "floats together (08 23)");
  talk.Run(Poll(0), Script({std::string("02 ") + kThree}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre(kMaskedRead, "08 23 02 00 00 00 00 00 02 00 00 03"));
}

TEST(Set4tmSnapshotTrial, ARefusalIsRememberedAndCostsNoValue) {
  for (const char* status : {"01", "02", "03", "08"}) {
    Talk talk = OpenTalk(Automatic());
    const Answer answer = talk.Run(Poll(0), Script({status, kGroup}));
    EXPECT_EQ(answer.outcome, Outcome::ok) << status;
    EXPECT_EQ(answer.readings.size(), 2U);
    talk.Run(Poll(0), Script({kGroup}));
    EXPECT_THAT(TakeAsked(talk), ElementsAre(kMaskedRead, "08 1B 02 00", "08 1B 02 00"));
    EXPECT_EQ(talk->WhatIsLearned(), "");
  }
}

TEST(Set4tmSnapshotTrial, SoIsSilence) {
  Talk talk = OpenTalk(Automatic());
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_FALSE(talk.request().expect.repeatable) << "silent once";
  EXPECT_EQ(talk.Fail(Poll(0), Outcome::no_reply), Then::ask_again);
  EXPECT_EQ(talk.Run(Poll(0), Script({kGroup})).outcome, Outcome::ok);
  talk.Run(Poll(0), Script({kGroup}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre(kMaskedRead, "08 1B 02 00", "08 1B 02 00"));
  talk->OnReconnect();
  talk.Run(Poll(0), Script({"00", std::string("02 ") + kThree}));
  EXPECT_EQ(talk->Queries().size(), 2U) << "it may be another meter";
}

TEST(Set4tmSnapshotTrial, NotSentIsNotTried) {
  Talk talk = OpenTalk(Automatic());
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_EQ(talk.Fail(Poll(0), Outcome::busy), Then::done);
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_THAT(TakeAsked(talk), ElementsAre(kMaskedRead, "08 23 02 00 00 00 00 00 02 00 00 03"));
}

TEST(Set4tmSnapshotTrial, WhatIsNotAllGoodIsNotTaken) {
  Talk talk = OpenTalk(Automatic());
  const Answer answer =
      talk.Run(Poll(0), Script({"01 00 50 5A 44 C2 F5 D6 41 01 00 80 7F", kGroup}));
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_EQ(answer.readings.size(), 2U);
  EXPECT_THAT(TakeAsked(talk), ElementsAre(kMaskedRead, "08 1B 02 00"));
}

TEST(Set4tmSnapshotTrial, AnAnswerOfAnotherLengthIsNone) {
  Talk talk = OpenTalk(Automatic());
  ASSERT_TRUE(talk.Ask(Poll(0)));
  for (const char* body : {"01 00 50 5A 44 C2 F5 D6 41", kGroup, "02 00 50 5A 44"}) {
    const Bytes frame = MakeFrame(Hex("05"), Hex(body));
    EXPECT_NE(talk->Check(talk.request().bytes, frame), Outcome::ok) << body;
  }
}

TEST(Set4tmSnapshotTrial, NoTrialWhereItSavesNothingOrTheTypeHasNone) {
  config::Device one =
      MakeDevice("5", {MakePoint("08 1B 02 00 float_le@0"), MakePoint("08 1B 02 00 float_le@4")});
  one.options.Set("snapshot", std::string("auto"));
  Talk talk = OpenTalk(one);
  talk.Run(Poll(0), Script({kGroup}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 1B 02 00"));

  config::Device old = Automatic();
  old.options.Set("types", std::vector<std::string>{"0"});
  Talk second = OpenTalk(old);
  EXPECT_EQ(second.Run(Poll(0), Script({"10 40 00"})).then, Then::restart);
  EXPECT_THAT(TakeAsked(second), ElementsAre("08 12")) << "integers from now on";
}

/// Every float of the reference has a value of its own: read by mask, by group and one by one, each
/// is where it belongs.
TEST(Set4tmSnapshotRead, NoValueComesFromAnotherPlace) {
  config::Device device = MakeDevice("5", {});
  FixedValues values;
  for (unsigned bit = 0; bit < 56; ++bit) {
    const auto parameter = MaskedParameter(bit);
    if (!parameter) continue;
    values.Set(device.points.size(), 1000.0 + *parameter);
    device.points.push_back(MakePoint("08 1B 00 " + HexByte(*parameter) + " float_le@0"));
  }
  device.options.Set("snapshot", std::string("auto"));
  MeterTwin twin(device, values);
  Talk talk(Set4tmProtocol(), device);
  talk.Run(Poll(0), twin);
  std::size_t seen = 0;
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    for (const Reading& reading : talk.Run(Poll(query), twin).readings) {
      EXPECT_EQ(ToDouble(reading.value), ToDouble(values.Get(reading.point, talk.now)))
          << device.points[reading.point].read;
      ++seen;
    }
  }
  EXPECT_EQ(seen, device.points.size());
  EXPECT_LE(talk->Queries().size(), 3U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
