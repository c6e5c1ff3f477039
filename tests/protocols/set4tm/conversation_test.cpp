// What the gateway asks a SET-4TM meter, and what it makes of every answer.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/conversation.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "protocols/set4tm/codec.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using config::Group;
using config::Type;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kOneFloat = "08 1B 00 11 float_le@0";

/// A wire that gives these reply bodies, one for each request, to the address that was asked.
Wire Script(std::vector<std::string> bodies) {
  auto rest = std::make_shared<std::vector<std::string>>(std::move(bodies));
  return [rest](View request) {
    if (rest->empty()) return Bytes();
    const Bytes body = Hex(rest->front());
    rest->erase(rest->begin());
    const auto parts = SplitFrame(request);
    return body.empty() ? Bytes() : MakeFrame(parts->address, body);
  };
}

config::Device OneFloat() { return MakeDevice("200", {MakePoint(kOneFloat)}); }

/// A meter whose channel is open already.
Talk OpenTalk(const config::Device& device) {
  Talk talk(Set4tmProtocol(), device);
  talk.Run(Probe(), Script({"00"}));
  talk.asked.clear();
  return talk;
}

TEST(Set4tmPlan, PointsOfOnePduShareAnExchange) {
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

TEST(Set4tmSession, WrongPasswordBacksOffForMinutes) {
  Talk talk(Set4tmProtocol(), OneFloat());
  const Answer answer = talk.Run(Poll(0), Script({"03"}));
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_THAT(answer.reason, HasSubstr("password"));
  EXPECT_GE(answer.wait, 1min);
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].quality, Quality::bad_configuration);
  EXPECT_FALSE(HasValue(answer.readings[0].value));
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

TEST(Set4tmSession, AnEchoedFloatReadIsNoValue) {
  Talk talk = OpenTalk(OneFloat());
  const Answer answer =
      talk.Run(Poll(0), [](View request) { return Bytes(request.begin(), request.end()); });
  EXPECT_EQ(answer.outcome, Outcome::unexpected);
  EXPECT_THAT(answer.reason, HasSubstr("echo"));
  EXPECT_TRUE(answer.readings.empty());
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

TEST(Set4tmEnergy, OptionsTakeThePlaceOfTheMetersConstants) {
  config::Device device = MakeDevice("5", {MakePoint("05 00 02 energy@0", Group::slow)});
  device.options.Set("meter_constant", std::int64_t{5000});
  device.options.Set("voltage_ratio", 100.0);
  device.options.Set("current_ratio", 20.0);
  Talk talk = OpenTalk(device);
  const Answer answer =
      talk.Run(Poll(0), Script({"00 00 27 11 00 00 00 00 00 00 13 89 00 00 00 65"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("05 00 02"));
  EXPECT_DOUBLE_EQ(std::get<double>(answer.readings.at(0).value), 2000.2);
}

TEST(Set4tmEnergy, WithoutTheVariantOnlyTheRawCountIsServed) {
  Talk talk = OpenTalk(MakeDevice("5", {MakePoint("05 00 02 energy@0", Group::slow),
                                        MakePoint("05 00 02 counts@0", Group::slow)}));
  const Answer answer =
      talk.Run(Poll(0), Script({"01", "00 01 00 01 00 00 00 00 00 00",
                                "00 00 27 11 00 00 00 00 00 00 13 89 00 00 00 65"}));
  ASSERT_EQ(answer.readings.size(), 2U);
  EXPECT_FALSE(HasValue(answer.readings[0].value));
  EXPECT_EQ(answer.readings[0].quality, Quality::bad_configuration);
  EXPECT_EQ(std::get<std::uint64_t>(answer.readings[1].value), 10001U);
}

TEST(Set4tmStatus, UnsupportedPointIsNotAskedAgain) {
  Talk talk =
      OpenTalk(MakeDevice("1", {MakePoint("08 1B 02 E0 float_le@0"), MakePoint(kOneFloat)}));
  const Answer answer = talk.Run(Poll(0), Script({"01"}));
  EXPECT_EQ(answer.outcome, Outcome::unsupported);
  EXPECT_EQ(answer.then, Then::replan);
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].point, 0U);
  EXPECT_EQ(answer.readings[0].quality, Quality::bad_configuration);
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_THAT(talk->Queries()[0].points, ElementsAre(1));
  talk->OnReconnect();
  EXPECT_EQ(talk->Queries().size(), 2U);
}

TEST(Set4tmStatus, EachCodeHasItsOutcomeAndPatience) {
  struct Row {
    const char* body;
    Outcome outcome;
    Duration wait;
  };
  const Row kRows[] = {{"02", Outcome::refused, 10s},  {"04", Outcome::refused, 0s},
                       {"07", Outcome::busy, 0s},      {"08", Outcome::busy, 1s},
                       {"58", Outcome::busy, 5s},      {"0A", Outcome::refused, 0s},
                       {"0F", Outcome::no_reply, 0s},  {"0C", Outcome::refused, 10s},
                       {"00", Outcome::unexpected, 0s}};
  for (const Row& row : kRows) {
    Talk talk = OpenTalk(OneFloat());
    const Answer answer = talk.Run(Poll(0), Script({row.body}));
    EXPECT_EQ(answer.outcome, row.outcome) << row.body;
    EXPECT_EQ(answer.wait, row.wait) << row.body;
    EXPECT_EQ(answer.then, Then::done) << row.body;
    EXPECT_FALSE(answer.reason.empty()) << row.body;
    for (const Reading& reading : answer.readings) EXPECT_FALSE(HasValue(reading.value));
  }
}

TEST(Set4tmStatus, NotReadyKeepsTheLastValueAsUncertain) {
  Talk talk = OpenTalk(OneFloat());
  const Answer answer = talk.Run(Poll(0), Script({"07"}));
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].quality, Quality::uncertain_last_usable);
}

TEST(Set4tmStatus, RepeatsOnceWhenAsked) {
  Talk talk = OpenTalk(OneFloat());
  EXPECT_EQ(talk.Run(Poll(0), Script({"06", "00 80 66 43"})).outcome, Outcome::ok);
  EXPECT_EQ(TakeAsked(talk).size(), 2U);
  EXPECT_EQ(talk.Run(Poll(0), Script({"06", "06"})).outcome, Outcome::busy);
  EXPECT_EQ(TakeAsked(talk).size(), 2U);
}

TEST(Set4tmAddressing, RepliesOfOtherMetersAreUnexpected) {
  const auto poll = [](const char* address, std::int64_t serial, const Bytes& replier) {
    config::Device device = MakeDevice(address, {MakePoint("08 05 u8@1")});
    device.options.Set("serial_number", serial);
    MeterConversation conversation(device);
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

TEST(Set4tmAddressing, ASwappedMeterServesNoValues) {
  config::Device device = OneFloat();
  device.options.Set("serial_number", std::int64_t{9020002});
  Talk talk = OpenTalk(device);
  const Answer answer = talk.Run(Poll(0), Script({"00 89 A2 61 06 09 02"}));
  EXPECT_EQ(answer.outcome, Outcome::refused);
  EXPECT_THAT(answer.reason, HasSubstr("9020001"));
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].quality, Quality::bad_configuration);
  // The right one is asked once.
  talk.Run(Poll(0), Script({"00 89 A2 62 06 09 02", "00 80 66 43"}));
  talk.Run(Poll(0), Script({"00 80 66 43"}));
  EXPECT_THAT(TakeAsked(talk), ElementsAre("08 00", "08 00", "08 1B 00 11", "08 1B 00 11"));
}

TEST(Set4tmFrames, WrongDataLengthIsUnexpected) {
  config::Device device = MakeDevice("5", {MakePoint("08 05 u8@1")});
  MeterConversation conversation(device);
  const Bytes request = MakeFrame(Hex("05"), Hex("08 05"));
  const Answer answer = conversation.Interpret(request, MakeFrame(Hex("05"), Hex("00 07 00")));
  EXPECT_EQ(answer.outcome, Outcome::unexpected);
  EXPECT_TRUE(answer.readings.empty());
  const Bytes damaged = Hex("05 00 07 00 00");
  EXPECT_EQ(conversation.Interpret(request, damaged).outcome, Outcome::corrupt);
  EXPECT_EQ(conversation.Interpret(damaged, damaged).outcome, Outcome::unexpected);
}

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

TEST(Set4tmDecode, ValuesWithoutAPointCarryALabel) {
  config::Device device = MakeDevice("5", {});
  MeterConversation conversation(device);
  const Answer answer =
      conversation.Interpret(Hex("05 05 00 02 91 28"), Hex("05 00 00 27 11 00 00 00 00 00 00 13 89 "
                                                           "00 00 00 65 67 40"));
  ASSERT_EQ(answer.readings.size(), 4U);
  EXPECT_EQ(answer.readings[0].point, kNoPoint);
  EXPECT_EQ(answer.readings[0].label, "05 00 02 counts@0");
  EXPECT_EQ(std::get<std::uint64_t>(answer.readings[3].value), 101U);
}

TEST(Set4tmDecode, RandomRepliesGiveFiniteValuesOrNone) {
  std::mt19937 random(42);
  std::vector<config::Point> points;
  for (const char* read : {"08 1B 02 00 float_le@12", "05 00 00 energy@0", "05 00 00 counts@12",
                           "08 11 00 power_be@0", "08 04 bcd(7)@0", "08 01 i8@1"}) {
    points.push_back(MakePoint(read));
  }
  for (const char* read : {"04 00 time@0", "08 00 date@4", "08 03 version@0",
                           "08 0B text_cp1251(16)@0", "08 0E time_min@0"}) {
    points.push_back(MakePoint(read, Group::fast, Type::string));
  }
  for (const char* read : {"08 0A alarm@0", "08 0A flag@40"}) {
    points.push_back(MakePoint(read, Group::fast, Type::boolean));
  }
  config::Device device = MakeDevice("5", points);
  MeterConversation conversation(device);
  for (int round = 0; round < 20'000; ++round) {
    const Bytes pdu = ParseField(points[random() % points.size()].read)->pdu;
    Bytes body(random() % 8 == 0 ? random() % 20 + 1 : *LengthOfData(pdu));
    for (std::uint8_t& byte : body) byte = static_cast<std::uint8_t>(random());
    const Answer answer =
        conversation.Interpret(MakeFrame(Hex("05"), pdu), MakeFrame(Hex("05"), body));
    for (const Reading& reading : answer.readings) {
      ASSERT_EQ(HasValue(reading.value), IsGood(reading.quality))
          << ToHex(pdu) << ": " << ToHex(body);
      if (const auto* number = std::get_if<double>(&reading.value)) {
        ASSERT_TRUE(std::isfinite(*number));
      }
    }
  }
}

TEST(Set4tmDecode, LearnsConstantsFromTheCapture) {
  config::Device device = MakeDevice("5", {MakePoint("05 00 02 energy@0")});
  MeterConversation conversation(device);
  const Bytes request = Hex("05 05 00 02 91 28");
  const Bytes reply = Hex("05 00 00 27 11 00 00 00 00 00 00 13 89 00 00 00 65 67 40");
  EXPECT_FALSE(HasValue(conversation.Interpret(request, reply).readings.at(0).value));
  const auto show = [&](const char* pdu, const char* data) {
    conversation.Interpret(MakeFrame(Hex("05"), Hex(pdu)), MakeFrame(Hex("05"), Hex(data)));
  };
  show("08 12", "10 40 80");
  show("08 02", "00 01 00 01 00 00 00 00 00 00");
  EXPECT_EQ(std::get<double>(conversation.Interpret(request, reply).readings.at(0).value), 1.0001);
}

TEST(Set4tmWrites, AreNotSent) {
  Talk talk(Set4tmProtocol(), OneFloat());
  EXPECT_EQ(talk.Run(Write(0, 1.0), Script({"00"})).outcome, Outcome::unsupported);
  EXPECT_TRUE(talk.asked.empty());
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
