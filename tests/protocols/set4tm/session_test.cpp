// Tests the channel of a SET-4TM meter: it is opened first, and again after a loss.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/plan.h"
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
  EXPECT_THAT(answer.reason, HasSubstr("the meter closed the channel right after it was opened"));
  EXPECT_EQ(TakeAsked(talk).size(), 3U);
}

TEST(Set4tmSession, AWrongPasswordIsTriedTwiceUntilTheDeviceIsEnabledAgain) {
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

TEST(Set4tmSession, AProbeOpensTheChannelAndRefusesAnEcho) {
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

/// Other bytes must not pass as a float: as a float, the request 08 1B 00 41 of another master
/// would be 8.0.
TEST(Set4tmSession, ARequestOfAnotherMasterIsNoFloat) {
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

TEST(Set4tmSnapshotRead, AReplyWithAnotherIdIsLate) {
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

TEST(Set4tmSnapshotTrial, AGoodReplyEnablesReadsByMask) {
  Talk talk = OpenTalk(Automatic());
  ASSERT_EQ(talk->Queries().size(), 3U);
  const Answer answer = talk.Run(Poll(0), Script({std::string("01 ") + kThree}));
  EXPECT_EQ(answer.then, Then::restart);
  ASSERT_EQ(answer.readings.size(), 3U) << "and its values count";
  EXPECT_EQ(std::get<double>(answer.readings[0].value), 873.25);
  EXPECT_EQ(talk->Queries().size(), 2U);
  EXPECT_EQ(talk->WhatIsLearned(), "floats are read together (08 23)");
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

TEST(Set4tmSnapshotTrial, SilenceIsRememberedAndCostsNoValue) {
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

TEST(Set4tmSnapshotTrial, AnUnsentTrialIsRepeated) {
  Talk talk = OpenTalk(Automatic());
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_EQ(talk.Fail(Poll(0), Outcome::busy), Then::done);
  ASSERT_TRUE(talk.Ask(Poll(0)));
  EXPECT_THAT(TakeAsked(talk), ElementsAre(kMaskedRead, "08 23 02 00 00 00 00 00 02 00 00 03"));
}

TEST(Set4tmSnapshotTrial, AReplyWithABadValueIsNotUsed) {
  Talk talk = OpenTalk(Automatic());
  const Answer answer =
      talk.Run(Poll(0), Script({"01 00 50 5A 44 C2 F5 D6 41 01 00 80 7F", kGroup}));
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_EQ(answer.readings.size(), 2U);
  EXPECT_THAT(TakeAsked(talk), ElementsAre(kMaskedRead, "08 1B 02 00"));
}

TEST(Set4tmSnapshotTrial, AReplyOfAnotherLengthIsUnexpected) {
  Talk talk = OpenTalk(Automatic());
  ASSERT_TRUE(talk.Ask(Poll(0)));
  for (const char* body : {"01 00 50 5A 44 C2 F5 D6 41", kGroup, "02 00 50 5A 44"}) {
    const Bytes frame = MakeFrame(Hex("05"), Hex(body));
    EXPECT_NE(talk->Check(talk.request().bytes, frame), Outcome::ok) << body;
  }
}

TEST(Set4tmSnapshotTrial, IsOmittedWhereItSavesNothingOrIsUnsupported) {
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

TEST(Set4tmSnapshotRead, EveryValueIsReadFromItsOwnPlace) {
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

TEST(Set4tmPlan, PointsOfAPduShareAnExchange) {
  const Talk talk(
      Set4tmProtocol(),
      MakeDevice("1",
                 {MakePoint("08 1B 02 00 float_le@0"), MakePoint("05 00 00 energy@0", Group::slow),
                  MakePoint("08 1B 02 00 float_le@4"), MakePoint("08 1B 02 04 float_le@0"),
                  MakePoint("08 1B 02 00 float_le@8", Group::slow)}));
  const auto queries = talk->Queries();
  ASSERT_EQ(queries.size(), 4U);
  EXPECT_THAT(queries[0].points, ElementsAre(0, 2));
  EXPECT_THAT(queries[1].points, ElementsAre(3));
  EXPECT_EQ(queries[2].group, Group::slow);
  EXPECT_THAT(queries[2].points, ElementsAre(4));
  EXPECT_THAT(queries[3].points, ElementsAre(1));
}

TEST(Set4tmAddressing, RepliesOfOtherMetersAreUnexpected) {
  const auto poll = [](const char* address, std::int64_t serial, const Bytes& replier) {
    config::Device device = MakeDevice(address, {MakePoint("08 05 u8@1")});
    device.options.Set("serial_number", serial);
    MeterBus bus;
    MeterConversation conversation(device, ReadSettings(device.options), bus);
    const Bytes request = MakeFrame(*ParseAddress(address), Hex("08 05"));
    return conversation.Interpret(request, MakeFrame(replier, Hex("00 07"))).outcome;
  };
  EXPECT_EQ(poll("7", 0, Hex("07")), Outcome::ok);
  EXPECT_EQ(poll("7", 0, Hex("08")), Outcome::unexpected);
  EXPECT_EQ(poll("0", 0, Hex("07")), Outcome::ok);
  EXPECT_EQ(poll("7", 0, ExtendedAddress(9020001)), Outcome::unexpected);
  EXPECT_EQ(poll("7", 9020001, ExtendedAddress(9020001)), Outcome::ok);
  EXPECT_EQ(poll("7", 9020002, ExtendedAddress(9020001)), Outcome::unexpected);
  EXPECT_EQ(poll("9020001", 0, ExtendedAddress(9020001)), Outcome::ok);
  EXPECT_EQ(poll("9020001", 0, Hex("07")), Outcome::unexpected);
}

/// C8 03 09 30 C8 00 has two or three bytes of data: C8 00 is also the CRC of 03 09 30.
TEST(Set4tmCheck, AFrameBeforeAZeroMayAnswerALongerRequest) {
  const config::Device device = MakeDevice("200", {MakePoint("08 05 u8@1")});
  MeterBus bus;
  const MeterConversation conversation(device, ReadSettings(device.options), bus);
  const Bytes two = Hex("C8 03 09 30 C8");
  const auto check = [&](const char* pdu) {
    return conversation.Check(MakeFrame(Bytes{0xC8}, Hex(pdu)), two);
  };
  EXPECT_EQ(check("08 01"), Outcome::ok);
  EXPECT_EQ(check("08 03"), Outcome::ok) << "the software's version has three";
  EXPECT_EQ(check("08 00"), Outcome::unexpected) << "the serial number has seven";
}

TEST(Set4tmAddressing, ASwappedMeterServesNoValues) {
  config::Device device = OneFloat();
  device.options.Set("serial_number", std::int64_t{9020002});
  Talk talk = OpenTalk(device);
  const Answer answer = talk.Run(Poll(0), Script({"00 89 A2 61 06 09 02"}));
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_THAT(answer.reason, HasSubstr("9020001"));
  EXPECT_EQ(talk->trouble().reason, Reason::swapped) << "of all points";
  talk->OnReconnect();
  EXPECT_TRUE(talk->trouble()) << "until it is known to be right";
  TakeAsked(talk);
  talk.Run(Poll(0), Script({"00", "00 89 A2 62 06 09 02", "00 80 66 43"}));
  EXPECT_FALSE(talk->trouble());
  talk.Run(Poll(0), Script({"00 80 66 43"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("01", "08 00", "08 1B 00 11", "08 1B 00 11"));
}

TEST(Set4tmFrames, WrongDataLengthIsUnexpected) {
  config::Device device = MakeDevice("5", {MakePoint("08 05 u8@1")});
  MeterBus bus;
  MeterConversation conversation(device, ReadSettings(device.options), bus);
  const Bytes request = MakeFrame(Hex("05"), Hex("08 05"));
  const Answer answer = conversation.Interpret(request, MakeFrame(Hex("05"), Hex("00 07 00")));
  EXPECT_EQ(answer.outcome, Outcome::unexpected);
  EXPECT_TRUE(answer.readings.empty());
  const Bytes damaged = Hex("05 00 07 00 00");
  EXPECT_EQ(conversation.Interpret(request, damaged).outcome, Outcome::corrupt);
  EXPECT_EQ(conversation.Interpret(damaged, damaged).outcome, Outcome::unexpected);
}

TEST(Set4tmWrites, AreNotSent) {
  Talk talk(Set4tmProtocol(), OneFloat());
  EXPECT_EQ(talk.Run(Write(0, 1.0), Script({"00"})).outcome, Outcome::unsupported);
  EXPECT_TRUE(talk.asked.empty());
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
