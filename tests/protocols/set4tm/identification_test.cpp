// What the type of a SET-4TM meter (08 12) decides: whether its profile fits, and what the bits of
// its status word are called.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "protocols/set4tm/conversation.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using config::Group;
using config::Type;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

config::Device OfTypes(std::vector<std::string> types) {
  return MakeDevice(
      "5",
      {MakePoint("08 1B 00 11 float_le@0"), MakePoint("08 0A alarm@0", Group::slow, Type::boolean),
       MakePoint("08 0A flag@1", Group::slow, Type::boolean)},
      {{"types", std::move(types)}});
}

constexpr const char* kIsType8 = "10 40 80";
constexpr const char* kIsType1 = "10 40 10";
constexpr const char* kFloat = "00 80 66 43";

TEST(Set4tmType, IsAskedOnceBeforeAnythingElse) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  EXPECT_EQ(talk.Run(Poll(0), Script({kIsType8, kFloat})).outcome, Outcome::ok);
  EXPECT_FALSE(talk->trouble());
  const Answer flags = talk.Run(Poll(1), Script({"01 00 00 00 80"}));
  EXPECT_EQ(flags.readings.at(0).value, Value(true));
  EXPECT_EQ(flags.readings.at(1).value, Value(true));
  talk.now += 16s;
  talk.Run(Poll(0), Script({"00", kFloat}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 12", "08 1B 00 11", "08 0A", "01", "08 1B 00 11"))
      << "opening the channel again is no other meter";
  talk->OnReconnect();
  talk.Run(Poll(0), Script({"00", kIsType8, kFloat}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("01", "08 12", "08 1B 00 11"));
}

TEST(Set4tmType, IsAskedAgainAfterSilence) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  talk.Run(Poll(0), Script({kIsType8, kFloat}));
  talk.Run(Poll(0), Script({}));
  TakeAsked(talk);
  talk.Run(Poll(0), Script({kIsType1}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 12"));
  EXPECT_EQ(talk->trouble().reason, Reason::other_module);
}

TEST(Set4tmType, AnotherOneIsNamedAndLeftInPeaceUntilItIsRight) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  const Answer answer = talk.Run(Poll(0), Script({kIsType1}));
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_EQ(answer.wait, 1min);
  EXPECT_EQ(talk->trouble().reason, Reason::other_module);
  EXPECT_THAT(talk->trouble().text, AllOf(HasSubstr("the meter is of type 1 (SET-4TM.03)"),
                                          HasSubstr("type 8 (SET-4TM.02M, .03M)"),
                                          HasSubstr("correct the profile or the address")));
  talk->OnReconnect();
  EXPECT_EQ(talk->trouble().reason, Reason::other_module) << "until it is known to be right";
  talk.Run(Poll(0), Script({"00", kIsType1}));
  talk.Run(Poll(0), Script({kIsType8, kFloat}));
  EXPECT_FALSE(talk->trouble());
}

TEST(Set4tmType, BitsOfAnotherTypeAreNeverCalledByTheTableOfDotZeroThreeM) {
  // Each type that the reference has, and one that it has not: only 8 has a table.
  for (unsigned type = 0; type < 16; ++type) {
    const std::string code(1, "0123456789ABCDEF"[type]);
    Talk talk = OpenTalk(OfTypes({code}));
    Answer answer = talk.Run(Poll(1), Script({"10 40 " + code + "0", "FF FF FF FF FF"}));
    // Without floats its points are read otherwise.
    if (answer.then == Then::restart) answer = talk.Run(Poll(1), Script({"FF FF FF FF FF"}));
    ASSERT_EQ(answer.readings.size(), 2U) << code;
    for (const Reading& reading : answer.readings) {
      EXPECT_EQ(IsGood(reading.quality), type == 8) << code;
      EXPECT_EQ(HasValue(reading.value), type == 8) << code;
      if (type != 8) {
        EXPECT_EQ(reading.quality, Quality(Quality::bad_configuration, Reason::not_fitted));
      }
    }
  }
}

TEST(Set4tmType, AMeterThatDoesNotTellContradictsNobody) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  EXPECT_EQ(talk.Run(Poll(0), Script({"01", kFloat})).outcome, Outcome::ok);
  EXPECT_FALSE(talk->trouble());
  const Answer flags = talk.Run(Poll(1), Script({"01 00 00 00 80"}));
  EXPECT_EQ(flags.readings.at(0).quality, Quality::bad_configuration) << "and names no bits";
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 12", "08 1B 00 11", "08 0A"));
}

TEST(Set4tmType, ALaterTypeThanTheReferenceIsOnlyARemark) {
  Talk talk = OpenTalk(OfTypes({"8"}));
  EXPECT_EQ(talk.Run(Poll(0), Script({"10 40 C0", kFloat})).outcome, Outcome::ok);
  EXPECT_FALSE(talk->trouble());
  EXPECT_THAT(talk->trouble().text, HasSubstr("type C"));
}

TEST(Set4tmType, IdentityIgnoreServesItWithoutTheBits) {
  config::Device device = OfTypes({"8"});
  device.identity.ignore = true;
  Talk talk = OpenTalk(device);
  EXPECT_EQ(talk.Run(Poll(0), Script({kFloat})).outcome, Outcome::ok);
  const Answer flags = talk.Run(Poll(1), Script({kIsType1, "01 00 00 00 80"}));
  EXPECT_FALSE(talk->trouble());
  EXPECT_EQ(flags.readings.at(0).quality, Quality::bad_configuration);
}

TEST(Set4tmType, WithoutAListItIsAskedForTheStatusWordOnly) {
  config::Device device = OfTypes({"8"});
  device.options.Set("types", std::vector<std::string>());
  Talk talk = OpenTalk(device);
  talk.Run(Poll(0), Script({kFloat}));
  talk.Run(Poll(1), Script({kIsType1, "01 00 00 00 80"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 1B 00 11", "08 12", "08 0A"));
  EXPECT_FALSE(talk->trouble());
}

TEST(Set4tmType, ATwinOfAnotherTypeIsFoundOut) {
  for (const char* type : {"0", "1", "3", "6"}) {
    config::Device other = OfTypes({type});
    FixedValues values;
    values.Set(0, 230.5);
    values.Set(1, true);
    values.Set(2, true);
    MeterTwin twin(other, values);
    Talk talk(Set4tmProtocol(), OfTypes({"8"}));
    talk.Run(Poll(0), twin);
    EXPECT_EQ(talk->trouble().reason, Reason::other_module) << type;
  }
}

TEST(Set4tmType, RefusesAListThatIsNone) {
  config::Options options = DefaultOptions();
  options.Set("types", std::vector<std::string>{"8", "G"});
  const Status status = CheckSettings(options);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error(), HasSubstr("\"G\" is no type code"));
}

TEST(Set4tmDay, WithTheMetersDayAllIsReadAnew) {
  Talk talk = OpenTalk(MakeDevice("5", {MakePoint("04 00 time@0", Group::slow, Type::string)}));
  const auto clock = [&](const char* data) { return talk.Run(Poll(0), Script({data})).then; };
  EXPECT_EQ(clock("31 30 15 01 02 09 02 00"), Then::done) << "the first reading is no new day";
  EXPECT_EQ(clock("59 59 23 01 02 09 02 00"), Then::done);
  EXPECT_EQ(clock("05 00 00 02 03 09 02 00"), Then::restart);
  EXPECT_EQ(clock("06 00 00 02 03 09 02 00"), Then::done);
}

TEST(Set4tmPace, TheMultiplierStretchesSilenceAndReply) {
  config::Device device = MakeDevice("5", {MakePoint("08 17 u8@1", Group::once, Type::uint16)});
  Talk talk = OpenTalk(device);
  const Duration character = 1145833ns;  // 11 bits at 9600
  EXPECT_FALSE(talk->LeastTimes(character).reply);
  talk.Run(Poll(0), Script({"00 05"}));
  const config::Timing times = talk->LeastTimes(character);
  EXPECT_EQ(times.quiet, 5 * 7 * character);
  EXPECT_EQ(times.reply, 2 * 5 * 7 * character + 5 * 100ms + 200ms);
  EXPECT_EQ(talk->WhatIsLearned(), "times by its multiplier 5");
  talk.Run(Poll(0), Script({"00 00"}));
  EXPECT_FALSE(talk->LeastTimes(character).reply) << "0 counts as 1";
  talk.Run(Poll(0), Script({"00 05"}));
  talk->OnReconnect();
  EXPECT_FALSE(talk->LeastTimes(character).reply);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
