// Tests the requests to a device and its replies: values, refusals, foreign and learned replies.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/conversation.h"

#include "protocols/spabus/reply.h"
#include "protocols/spabus/rules.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

std::vector<config::Point> Inputs() {
  return {MakePoint("I1"), MakePoint("I2"), MakePoint("I3"), MakePoint("I4"),
          MakePoint("I5", Type::boolean)};
}

TEST(SpaConversation, ReadsARangeInOneExchange) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs(), "2"));
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_EQ(Asked(talk, Poll(0)), ">2RI1/5:06");
  const Answer answer = Hear(talk, Poll(0), "<2D:0.52/0.49/0.51/0.00/0:");
  EXPECT_EQ(answer.outcome, Outcome::ok);
  ASSERT_EQ(answer.readings.size(), 5U);
  EXPECT_EQ(answer.readings[0].point, 0U);
  EXPECT_EQ(answer.readings[0].value, Value(0.52));
  EXPECT_EQ(answer.readings[4].value, Value(false));
  for (const Reading& reading : answer.readings) EXPECT_EQ(reading.quality, Quality::good);
}

TEST(SpaConversation, SendsTheWildcardIfConfigured) {
  config::Device device = MakeDevice(Inputs());
  device.options.Set("send_xx", true);
  Talk talk(SpabusProtocol(), std::move(device));
  EXPECT_EQ(Asked(talk, Poll(0)), ">1RI1/5:XX");
}

TEST(SpaConversation, ProbesWithTheIdentification) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs()));
  const Task probe{.kind = Task::Kind::probe};
  EXPECT_EQ(Asked(talk, probe), ">1RF:21");
  const Answer answer = Hear(talk, probe, "<1D: SPAJ 142C:");
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_EQ(Hear(talk, probe, "<1N:6:").then, Then::done) << "F is no point: nothing to plan anew";
}

TEST(SpaConversation, WrongShapesAreUnexpectedAndGiveNoReading) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs()));
  Asked(talk, Poll(0));
  for (const char* reply :
       {"<1D:0.52/0.49/0.51/0.00:", "<1D:0.52/0.49/0.51/0.00/0/1:", "<1D::", "<1A:", "<1N::"}) {
    const Answer answer = Hear(talk, Poll(0), reply);
    EXPECT_EQ(answer.outcome, Outcome::unexpected) << reply;
    EXPECT_TRUE(answer.readings.empty()) << reply;
    EXPECT_FALSE(answer.reason.empty()) << reply;
  }
}

/// "<1D:SPAJ 140 C:" is the reply to RF, which can come late.
TEST(SpaConversation, ATextInsteadOfANumberMayAnswerAnotherRequest) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs(), "2"));
  const Bytes request = talk->Ask(Poll(0), Instant{})->bytes;
  const Bytes numbers = ReplyText("<2D:0.52/0.49/0.51/0.00/0:");
  const Bytes texts = ReplyText("<2D:0.52/SPAJ/0.51/0.00/0:");
  EXPECT_EQ(talk->Check(request, numbers), Outcome::ok);
  EXPECT_EQ(talk->Check(request, texts), Outcome::unexpected);
  EXPECT_EQ(talk->Interpret(request, texts).outcome, Outcome::ok) << "a row of a profile is wrong";
}

TEST(SpaConversation, TheReplyOfAnotherSlaveIsSkipped) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs()));
  Asked(talk, Poll(0));
  Assembler assembler;
  assembler.Begin(SpabusProtocol().reply_rule, talk.request().expect);
  assembler.Feed(ReplyText("<2D:0.52/0.49/0.51/0.00/0:"));
  EXPECT_FALSE(assembler.Next(true));
  EXPECT_EQ(assembler.blame(), Outcome::unexpected);
  const Bytes own = ReplyText("<1D:0.52/0.49/0.51/0.00/0:");
  assembler.Feed(own);
  EXPECT_EQ(assembler.Next(true), own);
}

TEST(SpaConversation, ABadValueDoesNotAffectTheOthers) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs()));
  Asked(talk, Poll(0));
  const Answer answer = Hear(talk, Poll(0), "<1D:0.52//0.51/***/2:");
  EXPECT_EQ(answer.outcome, Outcome::ok);
  ASSERT_EQ(answer.readings.size(), 5U);
  EXPECT_EQ(answer.readings[0].quality, Quality::good);
  EXPECT_EQ(answer.readings[1].quality, Quality::bad_sensor_failure);
  EXPECT_EQ(answer.readings[2].quality, Quality::good);
  EXPECT_EQ(answer.readings[3].quality, Quality::bad_configuration);
  EXPECT_EQ(answer.readings[4].quality, Quality::bad_configuration);
  for (const std::size_t bad : {1, 3, 4}) EXPECT_FALSE(HasValue(answer.readings[bad].value));
}

TEST(SpaConversation, RefusalsHaveTheirOutcomes) {
  const std::map<int, Outcome> expected = {{0, Outcome::corrupt},     {1, Outcome::busy},
                                           {2, Outcome::busy},        {3, Outcome::unsupported},
                                           {4, Outcome::refused},     {5, Outcome::unsupported},
                                           {6, Outcome::unsupported}, {7, Outcome::refused},
                                           {8, Outcome::refused},     {9, Outcome::refused}};
  for (const auto& [code, outcome] : expected) {
    Talk talk(SpabusProtocol(), MakeDevice({MakePoint("I1")}));
    Asked(talk, Poll(0));
    const Answer answer = Hear(talk, Poll(0), "<1N:" + std::to_string(code) + ":");
    EXPECT_EQ(answer.outcome, outcome) << code;
    EXPECT_TRUE(answer.reason.starts_with("NACK " + std::to_string(code) + ": "));
    EXPECT_EQ(answer.wait > Duration::zero(), outcome == Outcome::busy) << code;
  }
}

TEST(SpaConversation, ATooComplicatedRequestReducesTheItemsOfAllRequests) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs()));
  Asked(talk, Poll(0));
  EXPECT_EQ(Hear(talk, Poll(0), "<1N:3:").then, Then::replan);
  EXPECT_EQ(AllRequests(talk), (Texts{">1RI1/2:", ">1RI3/4:", ">1RI5:"}));
  Asked(talk, Poll(0));
  EXPECT_EQ(Hear(talk, Poll(0), "<1N:3:").then, Then::replan);
  EXPECT_EQ(AllRequests(talk).size(), 5U);
}

TEST(SpaConversation, AFullInputBufferReducesTheItemsOfAllRequests) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs()));
  Asked(talk, Poll(0));
  const Answer answer = Hear(talk, Poll(0), "<1N:2:");
  EXPECT_EQ(answer.outcome, Outcome::busy);
  EXPECT_EQ(answer.then, Then::replan);
  EXPECT_EQ(AllRequests(talk), (Texts{">1RI1/2:", ">1RI3/4:", ">1RI5:"}));
  EXPECT_EQ(talk->WhatIsLearned(), "it accepts at most 2 items in one request");
  talk->OnReconnect();
  EXPECT_EQ(talk->WhatIsLearned(), "") << "it may be another device now";
}

TEST(SpaConversation, ReportsTheTextInPlaceOfANumber) {
  const struct {
    const char* reply;
    std::optional<std::string> said;
  } rows[] = {{"<1D:0.5/1:", std::nullopt}, {"<1D:0.5/0,7:", "0,7"}, {"<1D:/:", ""}};
  for (const auto& row : rows) {
    Talk talk(SpabusProtocol(), MakeDevice({MakePoint("I1"), MakePoint("I2")}));
    Asked(talk, Poll(0));
    EXPECT_EQ(Hear(talk, Poll(0), row.reply).no_number, row.said) << row.reply;
  }
}

TEST(SpaConversation, LacksTheTimeUntilTheHostClockIsRight) {
  config::Device device = MakeDevice(Inputs());
  EXPECT_FALSE(Talk(SpabusProtocol(), device)->LacksTime()) << "it is not to be told";
  device.options.Set("send_seconds", std::int64_t{Duration(1s).count()});
  Talk talk(SpabusProtocol(), device);
  EXPECT_TRUE(talk->LacksTime());
  talk->OnHostClock(true);
  EXPECT_FALSE(talk->LacksTime());
}

TEST(SpaConversation, AnUnknownErrorIsRetriedOnce) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs()));
  Asked(talk, Poll(0));
  EXPECT_EQ(Hear(talk, Poll(0), "<1N:9:").then, Then::ask_again);
  Asked(talk, Poll(0));
  const Answer second = Hear(talk, Poll(0), "<1N:9:");
  EXPECT_EQ(second.then, Then::done);
  EXPECT_EQ(second.outcome, Outcome::refused);
  Asked(talk, Poll(0));
  EXPECT_EQ(Hear(talk, Poll(0), "<1N:9:").then, Then::ask_again) << "the next poll, the next try";
  Asked(talk, Poll(0));
  EXPECT_EQ(Hear(talk, Poll(0), "<1D:0.52/0.49/0.51/0.00/0:").outcome, Outcome::ok);
}

TEST(SpaConversation, ReportsTheLearnedChecksums) {
  Talk talk(SpabusProtocol(), MakeDevice({MakePoint("I1")}));
  Asked(talk, Poll(0));
  talk.Reply(Poll(0), Sealed("<1D:0.5:", "XX"));
  EXPECT_EQ(talk->WhatIsLearned(), "it sends XX instead of checksums");
  Asked(talk, Poll(0));
  Hear(talk, Poll(0), "<1D:0.5:");
  EXPECT_EQ(talk->WhatIsLearned(), "");
}

/// An XOR does not detect some pairs of bit errors, so a damaged reply can look like a refusal
/// (NACK 5).
TEST(SpaConversation, ARefusalOfAnAnsweredItemIsAnOrdinaryFailure) {
  Talk talk(SpabusProtocol(), MakeDevice({MakePoint("I1")}));
  const auto say = [&](const std::string& reply) {
    Asked(talk, Poll(0));
    return Hear(talk, Poll(0), reply);
  };
  for (int round = 0; round < 3; ++round) {
    EXPECT_EQ(say("<1D:0.5:").readings.size(), 1U);
    for (int refusal = 0; refusal < 2; ++refusal) {
      const Answer refused = say("<1N:5:");
      EXPECT_TRUE(refused.readings.empty()) << "no verdict";
      EXPECT_EQ(refused.then, Then::done);
      EXPECT_EQ(talk->Queries()[0].group, config::Group::fast);
    }
  }
}

TEST(SpaConversation, FindsAMissingItemAndKeepsTheOthers) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs()));
  // The device lacks I4: requests are halved until I4 is read alone and refused three times.
  std::vector<Reading> bad;
  for (int round = 0; round < 10 && bad.empty(); ++round) {
    bool refused = false;
    for (std::size_t query = 0; query < talk->Queries().size() && !refused; ++query) {
      const auto& points = talk->Queries()[query].points;
      if (std::find(points.begin(), points.end(), 3U) == points.end()) continue;
      Asked(talk, Poll(query));
      const Answer answer = Hear(talk, Poll(query), "<1N:6:");
      bad.insert(bad.end(), answer.readings.begin(), answer.readings.end());
      refused = true;
    }
    if (!refused) break;
  }
  EXPECT_EQ(AllRequests(talk), (Texts{">1RI1/2:", ">1RI3:", ">1RI5:", ">1RI4:"}));
  EXPECT_EQ(talk->Queries().back().group, config::Group::daily);
  ASSERT_EQ(bad.size(), 1U) << "one reading tells that the point does not exist";
  EXPECT_EQ(bad[0].point, 3U);
  EXPECT_EQ(bad[0].quality, Quality::bad_configuration);
  EXPECT_FALSE(HasValue(bad[0].value));

  talk->OnReconnect();
  EXPECT_EQ(AllRequests(talk), (Texts{">1RI1/5:"})) << "the device may have been replaced";
}

TEST(SpaConversation, ABusyDeviceChangesNoPlan) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs()));
  Asked(talk, Poll(0));
  EXPECT_EQ(Hear(talk, Poll(0), "<1N:1:").then, Then::done);
  EXPECT_EQ(AllRequests(talk), (Texts{">1RI1/5:"}));
}

TEST(SpaConversation, LearnsTheChecksumReadingOfContinuedReplies) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs(), "3"));
  const std::string covered = "<3D:1.00/2.00/3.0&\r\n0/4.00/1:";
  std::uint8_t sum = 0;
  for (const char c : covered) {
    if (c != '\r' && c != '\n') sum ^= static_cast<std::uint8_t>(c);
  }
  Asked(talk, Poll(0));
  EXPECT_EQ(talk.request().expect.checksum & kCoversAny, kCoversAny);
  const Answer answer = talk.Reply(Poll(0), Sealed(covered, HexByte(sum)));
  ASSERT_EQ(answer.readings.size(), 5U);
  EXPECT_EQ(answer.readings[2].value, Value(3.0)) << "a value cut in the middle is joined";
  Asked(talk, Poll(0));
  EXPECT_EQ(talk.request().expect.checksum & kCoversAny, kCoversNoLineEnds);
}

TEST(SpaConversation, ForgetsALearnedChecksumAfterRepeatedDamage) {
  ContinuationChecksum learned;
  learned.Confirm(kCoversAll | kCoversNoLineEnds);
  learned.Confirm(kCoversAll);
  EXPECT_EQ(learned.accepted(), kCoversAll);
  learned.Doubt();
  learned.Doubt();
  learned.Confirm(kCoversAll);
  learned.Doubt();
  learned.Doubt();
  EXPECT_EQ(learned.accepted(), kCoversAll);
  learned.Doubt();
  EXPECT_EQ(learned.accepted(), kCoversAny);
}

TEST(SpaConversation, AConfiguredChecksumReadingIsNeverChanged) {
  config::Device device = MakeDevice(Inputs(), "3");
  device.options.Set("continuation_checksum", std::string("d"));
  Talk talk(SpabusProtocol(), std::move(device));
  Asked(talk, Poll(0));
  EXPECT_EQ(talk.request().expect.checksum & kCoversAny, kCoversLastLine);
}

TEST(SpaConversation, InterpretDecodesLikeOnFrame) {
  Talk talk(SpabusProtocol(), MakeDevice(Inputs(), "2"));
  const Answer answer =
      talk->Interpret(ToBytes(">2RI1/5:06\r"), ReplyText("<2D:0.52/0.49/0.51/0.00/0:"));
  ASSERT_EQ(answer.readings.size(), 5U);
  EXPECT_EQ(answer.readings[1].point, 1U);
  EXPECT_EQ(answer.readings[1].value, Value(0.49));
  EXPECT_EQ(talk->Interpret(ToBytes(">2RI1/5:06\r"), ReplyText("<2N:6:")).outcome,
            Outcome::unsupported);
  EXPECT_EQ(talk->Interpret(ToBytes("what"), ReplyText("<2N:6:")).outcome, Outcome::unexpected);
}

TEST(SpaConversation, InterpretLabelsItemsWithoutAPoint) {
  Talk talk(SpabusProtocol(), MakeDevice({}, "1"));
  const auto labels = [&](const std::string& request, const std::string& reply) {
    std::string text;
    for (const Reading& r : talk->Interpret(ToBytes(request), ReplyText(reply)).readings) {
      EXPECT_EQ(r.point, kNoPoint);
      text += r.label + "=" + ToText(r.value) + " ";
    }
    return text;
  };
  EXPECT_EQ(labels(">1RI1/3:XX\r", "<1D:0.52/1/ab:"), "I1=0.52 I2=1 I3=ab ");
  EXPECT_EQ(labels(">1R2/3V1/2:XX\r", "<1D:1/2/3/4:"), "2V1=1 2V2=2 3V1=3 3V2=4 ");
  EXPECT_EQ(labels(">1RF:XX\r", "<1D:SPCJ 4D29:"), "F=SPCJ 4D29 ");
  EXPECT_EQ(labels(">1RL:XX\r", "<1D:12.345 0E1/12.410 0E3:"), "L=12.345 0E1 L=12.410 0E3 ");
  EXPECT_EQ(labels(">1RL:XX\r", "<1D::"), "");
  EXPECT_EQ(labels(">1R3A:XX\r", "<1D:trip/start:"), "3A=trip/start ");
}

TEST(SpaConversation, AHugeRangeInACaptureIsHarmless) {
  Talk talk(SpabusProtocol(), MakeDevice({}, "1"));
  const Answer answer = talk->Interpret(ToBytes(">1R0/999V0/999999:XX\r"), ReplyText("<1D:1:"));
  EXPECT_EQ(answer.outcome, Outcome::unexpected);
}

Expectation Expected(const std::string& request) {
  return Expect(ToBytes(request), ReadSettings(OptionsOf(SpabusProtocol())));
}

TEST(SpaExpectation, FollowsFromTheRequest) {
  EXPECT_TRUE(Expected(">1RI1/5:XX\r").repeatable);
  EXPECT_TRUE(Expected(">1RB:XX\r").repeatable);
  EXPECT_FALSE(Expected(">1RL:XX\r").repeatable) << "reading L takes the events away";
  EXPECT_FALSE(Expected(">1WV150:1:XX\r").repeatable);
  EXPECT_EQ(Expected(">900WT:12.345:1B\r").reply, Expectation::Reply::none);
  EXPECT_EQ(Expected(">1RF:21\r").reply, Expectation::Reply::one);
  EXPECT_EQ(Expected(">12RF:XX\r").address, ToBytes("12"));
  EXPECT_EQ(Expected(">12RF:XX\r").checksum, kCoversAny | kWildcardAccepted);
  EXPECT_LE(Expected(">1RI1/8:XX\r").max_bytes, 1200U);
  EXPECT_LE(Expected(">1RV0/999999:XX\r").max_bytes, kMaxReply);
  EXPECT_FALSE(Expected("nonsense").repeatable);
}

TEST(SpaExpectation, HidesThePassword) {
  using Secrets = std::vector<std::pair<std::size_t, std::size_t>>;
  EXPECT_EQ(Expected(">1WV160:345:XX\r").secrets, (Secrets{{8, 3}, {12, 2}}));
  EXPECT_EQ(Expected(">1WV161:345:XX\r").secrets, (Secrets{{8, 3}, {12, 2}}));
  EXPECT_TRUE(Expected(">1WV150:1:XX\r").secrets.empty());
}

}  // namespace
}  // namespace baudgate::protocols::spabus
