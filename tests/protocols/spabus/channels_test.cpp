// The same item of consecutive channels in one request, and devices that do not understand it.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/conversation.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

std::vector<config::Point> ThreeChannels() {
  return {MakePoint("1I1"), MakePoint("2I1"), MakePoint("3I1")};
}

TEST(SpaChannels, ReadsARangeOfChannels) {
  Talk talk(SpabusProtocol(), MakeDevice(ThreeChannels()));
  EXPECT_EQ(AllRequests(talk), (Texts{">1R1/3I1:"}));
  Asked(talk, Poll(0));
  const Answer answer = Hear(talk, Poll(0), "<1D:1/2/3:");
  ASSERT_EQ(answer.readings.size(), 3U);
  EXPECT_EQ(answer.readings[2].point, 2U);
  EXPECT_EQ(ToDouble(answer.readings[2].value), 3);
  EXPECT_EQ(talk->WhatIsLearned(), "several channels in one request");
}

TEST(SpaChannels, AsksChannelByChannelWhereARangeIsNotUnderstood) {
  for (const char* refusal : {"<1N:3:", "<1N:5:"}) {
    Talk talk(SpabusProtocol(), MakeDevice(ThreeChannels()));
    Asked(talk, Poll(0));
    EXPECT_EQ(Hear(talk, Poll(0), refusal).then, Then::replan);
    EXPECT_EQ(AllRequests(talk), (Texts{">1R1I1:", ">1R2I1:", ">1R3I1:"})) << refusal;
    EXPECT_EQ(talk->WhatIsLearned(), "one channel in one request");
  }
  for (const Outcome outcome : {Outcome::no_reply, Outcome::unexpected}) {
    Talk talk(SpabusProtocol(), MakeDevice(ThreeChannels()));
    Asked(talk, Poll(0));
    EXPECT_EQ(talk.Fail(Poll(0), outcome), Then::done) << "one reply may be lost";
    Asked(talk, Poll(0));
    EXPECT_EQ(talk.Fail(Poll(0), outcome), Then::replan);
    EXPECT_EQ(AllRequests(talk).size(), 3U);
  }
}

TEST(SpaChannels, ALostReplyIsNotHeldAgainstARangeThatHasWorked) {
  Talk talk(SpabusProtocol(), MakeDevice(ThreeChannels()));
  Asked(talk, Poll(0));
  Hear(talk, Poll(0), "<1D:1/2/3:");
  for (int i = 0; i < 5; ++i) {
    Asked(talk, Poll(0));
    EXPECT_EQ(talk.Fail(Poll(0), Outcome::no_reply), Then::done);
  }
  EXPECT_EQ(AllRequests(talk), (Texts{">1R1/3I1:"}));
}

TEST(SpaChannels, ADeviceThatIsSilentToSeveralItemsIsAskedForFewer) {
  Talk talk(SpabusProtocol(), MakeDevice({MakePoint("I1"), MakePoint("I2"), MakePoint("V1")}));
  ASSERT_EQ(AllRequests(talk), (Texts{">1RI1/2:", ">1RV1:"}));
  const auto fail = [&] {
    Asked(talk, Poll(0));
    return talk.Fail(Poll(0), Outcome::no_reply);
  };
  for (int i = 0; i < 5; ++i) EXPECT_EQ(fail(), Then::done) << "it may be away";
  Asked(talk, Poll(1));
  Hear(talk, Poll(1), "<1D:7:");
  EXPECT_EQ(fail(), Then::done);
  EXPECT_EQ(fail(), Then::done);
  EXPECT_EQ(fail(), Then::replan);
  EXPECT_EQ(AllRequests(talk), (Texts{">1RI1:", ">1RI2:", ">1RV1:"}));
}

}  // namespace
}  // namespace baudgate::protocols::spabus
