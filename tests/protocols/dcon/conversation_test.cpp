// Planning, asking and decoding of a DCON device, and the same against its twin.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/conversation.h"

#include <cmath>

#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Group;
using config::Type;

constexpr std::string_view kEight = ">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880FC\r";

TEST(DconPlan, OneRequestForAllValuesOfACommand) {
  const config::Device device = EightInputs();
  Talk talk(DconProtocol(), device);
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_EQ(talk->Queries()[0].points.size(), 8U);
  EXPECT_EQ(Asked(talk, Poll(0)), "#0184\r");
}

TEST(DconPlan, CommandsAndGroupsApart) {
  const config::Device device = MakeDevice(
      {ReadPoint("a", "#[0]"), ReadPoint("b", "#3"), ReadPoint("c", "#[1]"),
       ReadPoint("d", "$M", Type::string, Group::once),
       ReadPoint("e", "#[2]", Type::float32, Group::slow), WritePoint("f", "", "#2{+00.000}")},
      {}, "0x4A");
  Talk talk(DconProtocol(), device);
  ASSERT_EQ(talk->Queries().size(), 4U);
  EXPECT_EQ(talk->Queries()[0].points, (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(talk->Queries()[2].group, Group::slow);
  EXPECT_EQ(talk->Queries()[3].group, Group::once);
  EXPECT_EQ(Asked(talk, Poll(1)), "#4A3\r");
  EXPECT_EQ(Asked(talk, Poll(3)), "$4AM\r");
}

TEST(DconConversation, EightValues) {
  const config::Device device = EightInputs();
  Talk talk(DconProtocol(), device);
  const Answer answer = Exchange(talk, Poll(0), kEight);
  ASSERT_EQ(answer.outcome, Outcome::ok) << answer.reason;
  ASSERT_EQ(answer.readings.size(), 8U);
  EXPECT_EQ(answer.readings[0].point, 0U);
  EXPECT_EQ(answer.readings[5].value, Value{1038.9});
  EXPECT_EQ(answer.readings[7].value, Value{5.88});
  EXPECT_EQ(answer.readings[7].quality, Quality::good);
}

TEST(DconConversation, ASensorInTroubleCostsNoOther) {
  const config::Device device = MakeDevice({ReadPoint("a", "#[0]"), ReadPoint("b", "#[1]")});
  Talk talk(DconProtocol(), device);
  const Answer answer = Exchange(talk, Poll(0), ">+99999+34.050\r");
  ASSERT_EQ(answer.outcome, Outcome::ok);
  EXPECT_FALSE(HasValue(answer.readings[0].value));
  EXPECT_EQ(answer.readings[0].quality, Quality::bad_sensor_failure);
  EXPECT_EQ(answer.readings[1].value, Value{34.05});
  EXPECT_NE(answer.reason.find("channel 0 over range (+99999)"), std::string::npos)
      << answer.reason;
}

TEST(DconConversation, DamageAndForeignRepliesGiveNoReading) {
  const config::Device device = EightInputs();
  Talk talk(DconProtocol(), device);
  struct Case {
    std::string_view wire;
    Outcome outcome;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"", Outcome::no_reply},
           {">+100.23+34.050", Outcome::partial},
           {">+100.23+34.050E3\r", Outcome::corrupt},
           {">+100.23+34.050E2\r", Outcome::unexpected},  // two values of another module
           {">-02.47197\r", Outcome::unexpected},
           {"!01200600AA\r", Outcome::unexpected},
           {"?0AB0\r", Outcome::unexpected},
           {">3E\r", Outcome::unexpected},
       }) {
    const Answer answer = Exchange(talk, Poll(0), c.wire);
    EXPECT_EQ(answer.outcome, c.outcome) << c.wire << ": " << answer.reason;
    EXPECT_TRUE(answer.readings.empty()) << c.wire;
  }
}

TEST(DconConversation, AnotherModulesNameIsPassedOver) {
  const config::Device device = MakeDevice({}, {{"checksum", true}});
  Talk talk(DconProtocol(), device);
  const auto request = talk->Ask({.kind = Task::Kind::probe}, {});
  ASSERT_TRUE(request);
  Assembler assembler;
  assembler.Begin(DconProtocol().reply_rule, request->expect);
  const Bytes own = BuildReply("!017017", true);
  assembler.Feed(BuildReply("!4A7017", true));
  assembler.Feed(own);
  EXPECT_EQ(assembler.Next(true), own);
  EXPECT_EQ(assembler.blame(), Outcome::unexpected);
}

TEST(DconConversation, AModuleWithoutANameIsProbedAsItIsNotPolled) {
  const config::Device device = EightInputs({{"identify", false}});
  Talk talk(DconProtocol(), device);
  const Task probe{.kind = Task::Kind::probe};
  const auto asked = [&] { return std::string(AsText(talk->Ask(probe, {})->bytes)).substr(0, 4); };
  EXPECT_EQ(asked(), "#010");
  // The reply to a poll is none to the probe, nor the other way round.
  const Bytes all = BuildReply(">+1.0000+2.0000+3.0000+4.0000+5.0000+6.0000+7.0000+8.0000", true);
  const auto request = talk->Ask(probe, {});
  EXPECT_EQ(talk->OnFrame(probe, *request, all, {}).outcome, Outcome::unexpected);
  const Bytes one = BuildReply(">+1.0000", true);
  const auto poll = talk->Ask(Poll(0), {});
  EXPECT_EQ(talk->OnFrame(Poll(0), *poll, one, {}).outcome, Outcome::unexpected);
  EXPECT_EQ(talk->OnFrame(probe, *request, one, {}).outcome, Outcome::ok);
  // One that has answered it once is asked nothing else.
  talk->OnFailure(probe, *request, Outcome::no_reply, {});
  EXPECT_EQ(asked(), "#010");
}

TEST(DconConversation, AModuleThatKnowsNoSingleChannelIsProbedWithItsPoll) {
  const config::Device device = EightInputs({{"identify", false}});
  Talk talk(DconProtocol(), device);
  const Task probe{.kind = Task::Kind::probe};
  const Bytes all = BuildReply(">+1.0000+2.0000+3.0000+4.0000+5.0000+6.0000+7.0000+8.0000", true);
  const auto asked = [&] { return std::string(AsText(talk->Ask(probe, {})->bytes)).substr(0, 4); };
  for (int round = 0; round < 3; ++round) {
    EXPECT_EQ(asked(), "#010");
    talk->OnFailure(probe, *talk->Ask(probe, {}), Outcome::no_reply, {});
    EXPECT_EQ(talk->OnFrame(probe, *talk->Ask(probe, {}), all, {}).outcome, Outcome::ok);
  }
  EXPECT_EQ(asked().substr(0, 3), "#01");
  EXPECT_NE(asked(), "#010");
}

TEST(DconConversation, TwoDecodersOfOneCommandAreNotBothBelieved) {
  const config::Device device =
      MakeDevice({ReadPoint("a", "#0 counter", Type::uint32), ReadPoint("b", "#0")});
  Talk talk(DconProtocol(), device);
  const Answer answer = Exchange(talk, Poll(0), ">0001E240\r");
  ASSERT_EQ(answer.readings.size(), 2U);
  EXPECT_EQ(answer.readings[0].value, Value{std::uint64_t{123456}});
  EXPECT_EQ(answer.readings[1].quality, Quality::bad_configuration);
}

TEST(DconInterpret, WithoutPointsValuesCarryLabels) {
  const config::Device device = MakeDevice({}, {{"checksum", true}});
  Talk talk(DconProtocol(), device);
  const Answer two = talk->Interpret(ToBytes("#0184\r"), ToBytes(">+100.23+34.050E2\r"));
  ASSERT_EQ(two.outcome, Outcome::ok) << two.reason;
  ASSERT_EQ(two.readings.size(), 2U);
  EXPECT_EQ(two.readings[0].point, kNoPoint);
  EXPECT_EQ(two.readings[0].label, "#[0]");
  EXPECT_EQ(two.readings[1].label, "#[1]");
  EXPECT_EQ(two.readings[1].value, Value{34.05});
  const Answer name = talk->Interpret(ToBytes("$0BME3\r"), ToBytes("!0B706060\r"));
  EXPECT_EQ(name.readings[0].label, "$M");
  EXPECT_EQ(name.readings[0].value, Value{std::string("7060")});
  EXPECT_EQ(talk->Interpret(ToBytes("#0A130159\r"), ToBytes("!21\r")).outcome, Outcome::refused);
  EXPECT_EQ(talk->Interpret(ToBytes("#01\r"), ToBytes(">\r")).outcome, Outcome::corrupt);
}

TEST(DconInterpret, PointsWhereTheyMatchLabelsElsewhere) {
  const config::Device device =
      MakeDevice({ReadPoint("b", "#[1]")}, {{"channels", std::int64_t{2}}});
  Talk talk(DconProtocol(), device);
  const Answer answer = talk->Interpret(ToBytes("#01\r"), ToBytes(">+100.23+34.050\r"));
  ASSERT_EQ(answer.readings.size(), 2U);
  EXPECT_EQ(answer.readings[0].point, 0U);
  EXPECT_EQ(answer.readings[0].value, Value{34.05});
  EXPECT_EQ(answer.readings[1].label, "#[0]");
  EXPECT_EQ(Exchange(talk, Poll(0), ">+100.23+34.050\r").readings.size(), 1U);
}

TEST(DconInterpret, APolledDeviceIsReadByItsOptionsOnly) {
  const config::Device device =
      MakeDevice({ReadPoint("in", "#[0]"), WritePoint("out", "#1", "#1{+00.000}")});
  Talk talk(DconProtocol(), device);
  EXPECT_NE(talk->Interpret(ToBytes("#01\r"), ToBytes(">7FFF\r")).outcome, Outcome::ok);
  EXPECT_NE(talk->Interpret(ToBytes("#01\r"), ToBytes(">01+05.880\r")).outcome, Outcome::ok);
  EXPECT_EQ(talk->Interpret(ToBytes("#011+05.000\r"), ToBytes("!01\r")).outcome,
            Outcome::unexpected)
      << "write_ack_address is off";
}

/// The module's checksum is on, and nobody has said so: its digits make no other number.
TEST(DconInterpret, AnUnexpectedChecksumMakesNoNumberWithoutPointsEither) {
  const config::Device device = MakeDevice({});
  Talk talk(DconProtocol(), device);
  for (const auto& [request, reply] : {std::pair("#010", ">-02.47197"),
                                       {"#01", ">+100.23+34.05012"},
                                       {"@01", ">0F0014"},
                                       {"$016", "!0F0000C7"},
                                       {"#010", "!010004289"},
                                       {"$01A", ">7FFF800012"},
                                       {"$012", "!0140060012"},
                                       {"~010", "!010482"},
                                       {"#010", ">0001E240DA"}}) {
    const Answer answer =
        talk->Interpret(ToBytes(std::string(request) + "\r"), ToBytes(std::string(reply) + "\r"));
    EXPECT_NE(answer.outcome, Outcome::ok) << request << " " << reply;
    EXPECT_TRUE(answer.readings.empty()) << request << " " << reply;
  }
}

TEST(DconExpect, SaysWhatMayBeRepeatedAndWhoAnswers) {
  const Settings settings = ReadSettings(MakeOptions({{"checksum", true}}));
  const auto expect = [&](std::string_view command) {
    return Expect(BuildRequest(command, 1, true), settings);
  };
  EXPECT_TRUE(expect("#").repeatable);
  EXPECT_TRUE(expect("#1301").repeatable);
  EXPECT_FALSE(expect("$4").repeatable);
  EXPECT_FALSE(expect("$60").repeatable);
  EXPECT_FALSE(expect("%0C400640").repeatable);
  EXPECT_EQ(AsText(expect("$M").address), "01");
  EXPECT_TRUE(expect("#").address.empty());
  EXPECT_EQ(expect("#").checksum, kChecksum);
  EXPECT_EQ(expect("#0").checksum, kChecksumEither);
  EXPECT_EQ(Expect(ToBytes("~**D2\r"), settings).reply, Expectation::Reply::none);
  EXPECT_EQ(Expect({}, settings).checksum, kChecksum);
  EXPECT_EQ(Expect({}, ReadSettings(MakeOptions())).checksum, kNoChecksum);
  EXPECT_FALSE(Expect(ToBytes("nonsense"), settings).repeatable);
  EXPECT_EQ(expect("#").max_bytes, kMaxFrame);
  EXPECT_FALSE(expect("#").shapes.empty());
}

TEST(DconRoundTrip, EveryFormAgainstTheTwin) {
  for (const bool checksum : {false, true}) {
    const config::Device device = MakeDevice(
        {ReadPoint("a", "#[0]"), ReadPoint("b", "#[1]"), ReadPoint("c", "#5 counter", Type::uint32),
         ReadPoint("d", "#6 decimal", Type::uint16), ReadPoint("e", "$6[b9]", Type::boolean),
         ReadPoint("f", "$6[low]", Type::uint16), ReadPoint("g", "$80"),
         ReadPoint("h", "$B", Type::uint16), ReadPoint("i", "$M", Type::string),
         ReadPoint("j", "$3")},
        {{"checksum", checksum}}, "200");
    FixedValues values;
    values.values = {
        {0, 5.25}, {1, -1038.9}, {2, std::uint64_t{0xFFFFFFFF}}, {3, 65535.0}, {4, true}, {5, 0x55},
        {6, 7.5},  {7, 0x81},    {8, std::string("7017")},       {9, 24.5}};
    DconTwin twin(device, values);
    Talk talk(DconProtocol(), device);
    std::size_t seen = 0;
    for (std::size_t q = 0; q < talk->Queries().size(); ++q) {
      const Answer answer = talk.Run(Poll(q), twin);
      EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
      for (const Reading& reading : answer.readings) {
        ++seen;
        EXPECT_EQ(reading.quality, Quality::good);
        const Value& truth = values.values.at(reading.point);
        if (std::holds_alternative<std::string>(truth)) {
          EXPECT_EQ(reading.value, truth);
        } else {
          EXPECT_EQ(ToDouble(reading.value), ToDouble(truth)) << device.points[reading.point].name;
        }
      }
    }
    EXPECT_EQ(seen, device.points.size());
  }
}

TEST(DconRoundTrip, HexFormatsAndFloatingPoint) {
  for (const Settable& options : std::initializer_list<Settable>{
           {},
           {{"format", std::string("hex")}, {"full_scale", 2000.0}},
           {{"format", std::string("hex")}, {"full_scale", 2000.0}, {"hex_unsigned", true}},
           {{"format", std::string("percent")}},
           {{"data_address", true}}}) {
    const config::Device device = EightInputs(options);
    FixedValues values;
    for (std::size_t i = 0; i < 8; ++i)
      values.values[i] = std::pow(3.0, static_cast<double>(i) - 1);
    DconTwin twin(device, values);
    Talk talk(DconProtocol(), device);
    const Answer answer = talk.Run(Poll(0), twin);
    ASSERT_EQ(answer.outcome, Outcome::ok) << answer.reason;
    ASSERT_EQ(answer.readings.size(), 8U);
    for (const Reading& reading : answer.readings) {
      EXPECT_NEAR(ToDouble(reading.value), ToDouble(values.values[reading.point]), 0.06);
    }
  }
}

}  // namespace
}  // namespace baudgate::protocols::dcon
