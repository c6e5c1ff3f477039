// Tests planning, requests and decoding of a DCON device, with given replies and with its simulated
// device.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/conversation.h"

#include <cmath>

#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Group;
using config::Type;

constexpr std::string_view kEight = ">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880FC\r";

TEST(DconPlan, AllValuesOfACommandShareARequest) {
  const config::Device device = EightInputs();
  Talk talk(DconProtocol(), device);
  ASSERT_EQ(talk->Queries().size(), 1U);
  EXPECT_EQ(talk->Queries()[0].points.size(), 8U);
  EXPECT_EQ(Asked(talk, Poll(0)), "#0184\r");
}

TEST(DconPlan, CommandsAndGroupsHaveSeparateRequests) {
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

TEST(DconConversation, ReadsEightValues) {
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

TEST(DconConversation, AFaultySensorDoesNotAffectOthers) {
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
           {">+100.23+34.050E2\r", Outcome::unexpected},
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

TEST(DconConversation, TheNameOfAnotherModuleIsSkipped) {
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

TEST(DconConversation, AModuleWithoutANameIsProbedUnlikeItsPolls) {
  const config::Device device = EightInputs({{"identify", false}});
  Talk talk(DconProtocol(), device);
  const Task probe{.kind = Task::Kind::probe};
  const auto asked = [&] { return std::string(AsText(talk->Ask(probe, {})->bytes)).substr(0, 4); };
  EXPECT_EQ(asked(), "#010");
  const Bytes all = BuildReply(">+1.0000+2.0000+3.0000+4.0000+5.0000+6.0000+7.0000+8.0000", true);
  const auto request = talk->Ask(probe, {});
  EXPECT_EQ(talk->OnFrame(probe, *request, all, {}).outcome, Outcome::unexpected);
  const Bytes one = BuildReply(">+1.0000", true);
  const auto poll = talk->Ask(Poll(0), {});
  EXPECT_EQ(talk->OnFrame(Poll(0), *poll, one, {}).outcome, Outcome::unexpected);
  EXPECT_EQ(talk->OnFrame(probe, *request, one, {}).outcome, Outcome::ok);
  talk->OnFailure(probe, *request, Outcome::no_reply, {});
  EXPECT_EQ(asked(), "#010");
}

TEST(DconConversation, AModuleWithoutSingleChannelReadsIsProbedWithItsPoll) {
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

TEST(DconConversation, OnlyOneOfTwoDecodersOfACommandApplies) {
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

TEST(DconInterpret, MatchingValuesAreAssignedToPointsAndOthersGetLabels) {
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

TEST(DconInterpret, APolledDeviceIsDecodedByItsOptionsOnly) {
  const config::Device device =
      MakeDevice({ReadPoint("in", "#[0]"), WritePoint("out", "#1", "#1{+00.000}")});
  Talk talk(DconProtocol(), device);
  EXPECT_NE(talk->Interpret(ToBytes("#01\r"), ToBytes(">7FFF\r")).outcome, Outcome::ok);
  EXPECT_NE(talk->Interpret(ToBytes("#01\r"), ToBytes(">01+05.880\r")).outcome, Outcome::ok);
  EXPECT_EQ(talk->Interpret(ToBytes("#011+05.000\r"), ToBytes("!01\r")).outcome,
            Outcome::unexpected)
      << "write_ack_address is off";
}

TEST(DconInterpret, AnUnexpectedChecksumGivesNoNumberWithoutPoints) {
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

TEST(DconExpect, MarksRepeatableAndAnsweredRequests) {
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

TEST(DconRoundTrip, EveryFormIsReadBackFromTheTwin) {
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

TEST(DconRoundTrip, HexFormatsAndFloatsAreReadBackFromTheTwin) {
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

TEST(DconSession, ARefusedCommandDoesNotAffectOthers) {
  const config::Device device = MakeDevice({ReadPoint("a", "#0"), ReadPoint("b", "#9")});
  Talk talk(DconProtocol(), device);
  EXPECT_EQ(Exchange(talk, Poll(0), ">+05.880\r").outcome, Outcome::ok);
  Answer refused = Exchange(talk, Poll(1), "?01\r");
  EXPECT_EQ(refused.outcome, Outcome::unsupported);
  EXPECT_TRUE(refused.readings.empty()) << "a damaged reply may look like that";
  EXPECT_EQ(refused.then, Then::replan);
  EXPECT_EQ(talk->Queries()[0].group, Group::fast);
  EXPECT_EQ(talk->Queries()[1].group, Group::slow);
  EXPECT_EQ(Exchange(talk, Poll(1), "?01\r").then, Then::done);
  refused = Exchange(talk, Poll(1), "?01\r");
  ASSERT_EQ(refused.readings.size(), 1U);
  EXPECT_EQ(refused.readings[0].point, 1U);
  EXPECT_EQ(refused.readings[0].quality, Quality::bad_configuration);
  EXPECT_FALSE(HasValue(refused.readings[0].value));

  EXPECT_EQ(Exchange(talk, Poll(1), ">+01.000\r").then, Then::replan) << "it answers again";
  EXPECT_EQ(talk->Queries()[1].group, Group::fast);
}

TEST(DconSession, AnUnansweredCommandIsRequestedRarely) {
  const config::Device device = MakeDevice({ReadPoint("a", "#0"), ReadPoint("b", "$3")});
  Talk talk(DconProtocol(), device);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done) << "the module itself may be away";
  }
  Exchange(talk, Poll(0), ">+05.880\r");
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done);
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done);
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::replan);
  EXPECT_EQ(talk->Queries()[1].group, Group::slow);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(Exchange(talk, Poll(0), "").then, Then::done);
  EXPECT_EQ(talk->Queries()[0].group, Group::fast) << "it has answered: the module is away";
  talk->OnReconnect();
  EXPECT_EQ(talk->Queries()[1].group, Group::fast);
}

TEST(DconSession, ProbesWithTheCheapestCommandThatWorks) {
  const config::Device device = MakeDevice(
      {ReadPoint("a", "#[0]"), ReadPoint("b", "#[1]"), ReadPoint("c", "#1"), ReadPoint("d", "$3")});
  Talk talk(DconProtocol(), device);
  EXPECT_EQ(Asked(talk, Probe()), "#01\r") << "nothing is known: the first query";
  Exchange(talk, Poll(0), ">+05.880+05.880\r");
  EXPECT_EQ(Asked(talk, Probe()), "#01\r");
  Exchange(talk, Poll(1), ">+05.880\r");
  EXPECT_EQ(Asked(talk, Probe()), "#011\r");
  talk->OnReconnect();
  EXPECT_EQ(Asked(talk, Probe()), "#011\r");
}

TEST(DconSession, AFailedProbeIsReplacedByOtherCommands) {
  const config::Device device =
      MakeDevice({ReadPoint("a", "$3"), ReadPoint("b", "#1"), ReadPoint("c", "$60 commanded")});
  Talk talk(DconProtocol(), device);
  std::vector<std::string> asked;
  for (int i = 0; i < 6; ++i) {
    asked.push_back(Asked(talk, Probe()));
    Exchange(talk, Probe(), "");
    talk->OnReconnect();
  }
  EXPECT_EQ(asked,
            (std::vector<std::string>{"$013\r", "#011\r", "$013\r", "$013\r", "$013\r", "#011\r"}))
      << "never the command that may reset a counter";
  EXPECT_EQ(Exchange(talk, Probe(), ">+01.000\r").outcome, Outcome::ok);
  EXPECT_EQ(Asked(talk, Probe()), "$013\r");
}

TEST(DconSession, ProbesByNameIfTheModuleHasAName) {
  const config::Device named = MakeDevice({ReadPoint("a", "#[0]")}, {{"identify", true}});
  Talk talk(DconProtocol(), named);
  EXPECT_EQ(Asked(talk, Probe()), "$01M\r");
  EXPECT_EQ(Exchange(talk, Probe(), "!017017\r").outcome, Outcome::ok);
  const config::Device no_reads = MakeDevice({WritePoint("a", "", "#0{+00.000}")});
  Talk writer(DconProtocol(), no_reads);
  EXPECT_EQ(Asked(writer, Probe()), "$01M\r");
}

TEST(DconSession, AWriteIsOneExchange) {
  const config::Device device =
      MakeDevice({WritePoint("relay", "$6[b8]", "#10{bit}", Type::boolean)});
  Talk talk(DconProtocol(), device);
  const Task on = Write(0, true);
  EXPECT_EQ(Asked(talk, on), "#011001\r");
  const Answer confirmed = Exchange(talk, on, ">\r");
  EXPECT_EQ(confirmed.outcome, Outcome::ok);
  EXPECT_EQ(confirmed.then, Then::done);
  EXPECT_EQ(Asked(talk, Write(0, false)), "#011000\r");
}

TEST(DconSession, RefusedWritesAreReported) {
  const config::Device device = MakeDevice({WritePoint("volts", "$80", "#0{+00.000 0..10}")});
  Talk talk(DconProtocol(), device);
  EXPECT_EQ(Exchange(talk, Write(0, 5.0), "!\r").outcome, Outcome::refused);
  EXPECT_EQ(Exchange(talk, Write(0, 5.0), "?\r").outcome, Outcome::refused);
  EXPECT_EQ(Exchange(talk, Write(0, 5.0), "?01\r").outcome, Outcome::refused);
  EXPECT_EQ(Exchange(talk, Write(0, 5.0), "?02\r").outcome, Outcome::unexpected);
  EXPECT_NE(Asked(talk, Write(0, 10.5)).find("outside 0...10"), std::string::npos);
  EXPECT_EQ(Asked(talk, Write(0, 5.0)), "#010+05.000\r");
}

/// DCON reference, 10.1: a module refuses a value beyond its range, but sets the output to the
/// limit of the range.
TEST(DconSession, ARefusedAnalogWriteMayHaveActed) {
  const config::Device device = MakeDevice({WritePoint("volts", "$80", "#0{+00.000 0..10}"),
                                            WritePoint("bare", "", "#{00.000}"),
                                            WritePoint("outputs", "", "@{hex2}", Type::uint16)});
  Talk talk(DconProtocol(), device);
  EXPECT_TRUE(Exchange(talk, Write(0, 5.0), "?\r").may_have_acted);
  EXPECT_TRUE(Exchange(talk, Write(1, 5.0), "?01\r").may_have_acted);
  const Answer ignored = Exchange(talk, Write(0, 5.0), "!\r");
  EXPECT_EQ(ignored.outcome, Outcome::refused);
  EXPECT_FALSE(ignored.may_have_acted) << "the host watchdog holds it";
  EXPECT_FALSE(Exchange(talk, Write(2, 255.0), "?\r").may_have_acted);
}

/// DCON reference, 9.1 and 14: the reply to a write of a setting is only !AA.
TEST(DconSession, AWriteOfASettingIsConfirmedWithTheAddress) {
  const config::Device device =
      MakeDevice({WritePoint("run", "$50[b0]", "$50{flag}", Type::boolean),
                  WritePoint("preset", "@G0", "@P0{hex8}", Type::uint32),
                  WritePoint("outputs", "@DI[b8-b9]", "@DO0{hex1}", Type::uint16),
                  WritePoint("adam", "$Y", "$X{dec4}", Type::uint16)});
  Talk talk(DconProtocol(), device);
  const std::vector<std::pair<Task, std::string>> writes = {{Write(0, true), "$01501\r"},
                                                            {Write(1, 123456.0), "@01P00001E240\r"},
                                                            {Write(2, 3.0), "@01DO03\r"},
                                                            {Write(3, 50.0), "$01X0050\r"}};
  for (const auto& [task, request] : writes) {
    EXPECT_EQ(Asked(talk, task), request);
    EXPECT_EQ(Exchange(talk, task, "!01\r").outcome, Outcome::ok) << request;
    EXPECT_EQ(Exchange(talk, task, ">\r").outcome, Outcome::unexpected) << request;
    EXPECT_EQ(Exchange(talk, task, "!02\r").outcome, Outcome::unexpected) << request;
    EXPECT_EQ(Exchange(talk, task, "?01\r").outcome, Outcome::refused) << request;
  }
  const std::vector<std::pair<std::string, Value>> reads = {
      {"!011\r", Value{true}},
      {"!010001E240\r", Value{std::uint64_t{123456}}},
      {"!0110300\r", Value{std::uint64_t{3}}},
      {"!010050\r", Value{std::uint64_t{50}}}};
  for (std::size_t query = 0; query < reads.size(); ++query) {
    const Answer answer = Exchange(talk, Poll(query), reads[query].first);
    ASSERT_EQ(answer.readings.size(), 1U) << answer.reason;
    EXPECT_EQ(answer.readings[0].value, reads[query].second);
  }
}

}  // namespace
}  // namespace baudgate::protocols::dcon
