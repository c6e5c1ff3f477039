// The channel of a SET-4TM meter: opened first, opened again, and what is forgotten with it.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "protocols/set4tm/conversation.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using config::Group;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Set4tmSession, OpensTheChannelFirstAndOnlyOnce) {
  Talk talk(Set4tmProtocol(), OneFloat());
  const Answer answer = talk.Run(Poll(0), Script({"00", "00 80 66 43"}));
  EXPECT_EQ(answer.outcome, Outcome::ok);
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(std::get<double>(answer.readings[0].value), 230.5);
  EXPECT_EQ(ToHex(talk.asked.at(0)), "C8 01 30 30 30 30 30 30 03 D2");
  EXPECT_EQ(ToHex(talk.asked.at(1)), "C8 08 1B 00 11 77 BB");
  talk.asked.clear();
  talk.now += 14s;
  talk.Run(Poll(0), Script({"00 80 66 43"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 1B 00 11"));
  talk.now += 16s;
  talk.Run(Poll(0), Script({"00", "00 80 66 43"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("01", "08 1B 00 11"));
}

TEST(Set4tmSession, ReopensOnceOnAClosedChannel) {
  Talk talk = OpenTalk(OneFloat());
  Answer answer = talk.Run(Poll(0), Script({"05", "00", "00 80 66 43"}));
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 1B 00 11", "01", "08 1B 00 11"));
  answer = talk.Run(Poll(0), Script({"05", "00", "05"}));
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_THAT(answer.reason, HasSubstr("channel not open"));
  EXPECT_EQ(TakeAsked(talk).size(), 3U);
}

TEST(Set4tmSession, AWrongPasswordIsTriedTwiceAndThenNotBeforeSomebodyHasLooked) {
  Talk talk(Set4tmProtocol(), OneFloat());
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_FALSE(talk.request().expect.repeatable) << "a meter that answers late gets it once";
  const Answer answer = talk.Run(Poll(0), Script({"03"}));
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_THAT(answer.reason, HasSubstr("the meter refuses the password"));
  EXPECT_EQ(answer.wait, 1h);
  EXPECT_EQ(talk->trouble().reason, Reason::password_refused) << "of all points";
  TakeAsked(talk);

  talk->OnReconnect();
  EXPECT_EQ(talk.Run(Poll(0), Script({"00"})).outcome, Outcome::refused);
  EXPECT_THAT(TakeAsked(talk), ElementsAre("00")) << "alive, and left in peace";
  EXPECT_EQ(talk.Run(Probe(), Script({"00"})).outcome, Outcome::ok);
  TakeAsked(talk);
  talk.now += 1h;
  talk.Run(Poll(0), Script({"03"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("01"));
  talk.now += 24h;
  EXPECT_THAT(talk.Run(Poll(0), Script({"00"})).reason, HasSubstr("'baudgate enable'"));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("00"));

  talk->OnEnabled();
  talk.Ask(Poll(0));
  talk.Fail(Poll(0), Outcome::unexpected);
  TakeAsked(talk);
  talk.Run(Poll(0), Script({"00"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("00")) << "whatever it answered, that was one try";

  talk->OnEnabled();
  talk.Run(Poll(0), Script({"00", "00 80 66 43"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("01", "08 1B 00 11"));
  EXPECT_FALSE(talk->trouble());
}

TEST(Set4tmSession, ProbeIsAnOpenAndNoEcho) {
  Talk talk(Set4tmProtocol(), OneFloat());
  const Task probe = Probe();
  EXPECT_EQ(talk.Run(probe, Script({"00"})).outcome, Outcome::ok);
  EXPECT_THAT(TakeAsked(talk), ElementsAre("01"));
  const Answer echo =
      talk.Run(probe, [](View request) { return Bytes(request.begin(), request.end()); });
  EXPECT_NE(echo.outcome, Outcome::ok);
}

TEST(Set4tmSession, AReadThatFailsBehindAProbeDoesNotCloseTheChannel) {
  Talk talk = OpenTalk(OneFloat());
  const Request read = *talk.Ask(Poll(0));
  EXPECT_EQ(talk.Run(Probe(), Script({"00"})).outcome, Outcome::ok);
  talk->OnFailure(Poll(0), read, Outcome::busy, talk.now);
  TakeAsked(talk);
  talk.Run(Poll(0), Script({"00 80 66 43"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 1B 00 11"));
}

TEST(Set4tmSession, AnEchoedFloatReadIsNoValue) {
  Talk talk = OpenTalk(OneFloat());
  const Answer answer =
      talk.Run(Poll(0), [](View request) { return Bytes(request.begin(), request.end()); });
  EXPECT_EQ(answer.outcome, Outcome::unexpected);
  EXPECT_THAT(answer.reason, HasSubstr("echo"));
  EXPECT_TRUE(answer.readings.empty());
}

/// 08 1B 00 41 would be 8.0 as a float.
TEST(Set4tmSession, TheQuestionOfAnotherMasterIsNoFloat) {
  for (const char* question : {"08 1B 00 41", "08 1B 02 00", "08 1B 00 11"}) {
    Talk talk = OpenTalk(OneFloat());
    const Answer answer = talk.Run(Poll(0), Script({question}));
    EXPECT_EQ(answer.outcome, Outcome::unexpected) << question;
    EXPECT_TRUE(answer.readings.empty()) << question;
  }
  Talk talk = OpenTalk(OneFloat());
  EXPECT_EQ(talk.Run(Poll(0), Script({"08 1B 66 43"})).outcome, Outcome::ok) << "230.1 V";
}

TEST(Set4tmSession, ReconnectForgetsChannelAndConstants) {
  Talk talk(Set4tmProtocol(), MakeDevice("5", {MakePoint("05 00 02 energy@0", Group::slow)}));
  const std::vector<std::string> replies = {"00", "10 40 80", "00 01 00 01 00 00 00 00 00 00",
                                            "00 00 27 11 00 00 00 00 00 00 13 89 00 00 00 65"};
  const Answer answer = talk.Run(Poll(0), Script(replies));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("01", "08 12", "08 02", "05 00 02"));
  EXPECT_EQ(std::get<double>(answer.readings.at(0).value), 1.0001);
  talk.Run(Poll(0), Script({replies[3]}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("05 00 02"));
  talk->OnReconnect();
  talk.Run(Poll(0), Script(replies));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("01", "08 12", "08 02", "05 00 02"));
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
