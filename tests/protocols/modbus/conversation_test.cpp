// Tests the requests of a Modbus conversation and which replies it accepts: values, exceptions,
// replies that do not fit, probes and writes.
// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/modbus/support.h"

namespace baudgate::protocols::modbus {
namespace {

using config::Group;
using config::Type;

config::Device Inverter(const Settable& options = {}) {
  return MakeDevice({ReadPoint("frequency", "holding 200"), ReadPoint("current", "holding 201"),
                     WritePoint("set", "holding 300 uint16", {}, Type::float32),
                     WritePoint("run", "", "holding 8"),
                     WritePoint("enable", "holding 310[b3]", {}, Type::boolean),
                     WritePoint("relay", "coil 4", {}, Type::boolean),
                     WritePoint("limit", "holding 320", {}, Type::uint32)},
                    options);
}

TEST(ModbusConversation, ReadsABlock) {
  const config::Device device = Inverter();
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(Asked(talk, Poll(0)), "03 00 C8 00 02");
  const Answer answer = Exchange(talk, Poll(0), "03 04 09C4 00CA");
  EXPECT_EQ(answer.outcome, Outcome::ok);
  ASSERT_EQ(answer.readings.size(), 2U);
  EXPECT_EQ(answer.readings[0].point, 0U);
  EXPECT_EQ(answer.readings[0].value, Value(std::uint64_t{2500}));
  EXPECT_EQ(answer.readings[1].value, Value(std::uint64_t{202}));
}

TEST(ModbusConversation, ReadsBits) {
  const config::Device device = MakeDevice(
      {ReadPoint("a", "discrete 10", Type::boolean), ReadPoint("b", "discrete 19", Type::boolean)});
  Talk talk(ModbusAsciiProtocol(), device);
  EXPECT_EQ(Asked(talk, Poll(0)), "02 00 0A 00 0A");
  const Answer answer = Exchange(talk, Poll(0), "02 02 0002");
  ASSERT_EQ(answer.readings.size(), 2U) << answer.reason;
  EXPECT_EQ(answer.readings[0].value, Value(false));
  EXPECT_EQ(answer.readings[1].value, Value(true));
}

TEST(ModbusConversation, AMismatchedReplyGivesNoReading) {
  const config::Device device = Inverter();
  Talk talk(ModbusRtuProtocol(), device);
  const Request request = *talk->Ask(Poll(0), Instant{});
  const auto answer = [&](std::uint8_t slave, const char* pdu) {
    return talk->OnFrame(Poll(0), request, Wrap(Framing::rtu, slave, Hex(pdu)), Instant{});
  };
  for (const auto& [slave, pdu] :
       {std::pair{21, "0304 09C4 00CA"}, std::pair{20, "0302 09C4"}, std::pair{20, "0404 09C400CA"},
        std::pair{20, "0600080002"}, std::pair{20, "8402"}}) {
    const Answer got = answer(static_cast<std::uint8_t>(slave), pdu);
    EXPECT_EQ(got.outcome, Outcome::unexpected) << pdu;
    EXPECT_TRUE(got.readings.empty());
    EXPECT_FALSE(got.reason.empty());
  }
  EXPECT_EQ(talk->OnFrame(Poll(0), request, Hex("140304"), Instant{}).outcome, Outcome::corrupt);
  Bytes wire = Wrap(Framing::rtu, 21, Hex("0304 1111 1111"));
  Append(wire, Wrap(Framing::rtu, 20, Hex("0304 09C4 00CA")));
  EXPECT_EQ(talk.Exchange(Poll(0), wire).outcome, Outcome::ok);
}

TEST(ModbusConversation, ExceptionsOfReadsHaveTheirOutcomes) {
  struct Case {
    const char* pdu;
    Outcome outcome;
    std::optional<Quality> quality;
    Duration wait;
  };
  constexpr Quality kNotFitted{Quality::bad_configuration, Reason::not_fitted};
  constexpr Quality kFault{Quality::bad_device_failure, Reason::device_fault};
  for (const Case& one :
       {Case{"8301", Outcome::unsupported, kNotFitted, 0ms},
        Case{"8302", Outcome::unsupported, kNotFitted, 0ms},
        Case{"8303", Outcome::unsupported, kNotFitted, 0ms},
        Case{"8304", Outcome::refused, kFault, 0ms}, Case{"8305", Outcome::busy, std::nullopt, 1s},
        Case{"8306", Outcome::busy, std::nullopt, 200ms},
        Case{"8307", Outcome::refused, std::nullopt, 0ms},
        Case{"8308", Outcome::refused, kFault, 0ms},
        Case{"830A", Outcome::no_reply, std::nullopt, 0ms},
        Case{"830B", Outcome::no_reply, std::nullopt, 0ms},
        Case{"8363", Outcome::refused, std::nullopt, 0ms}}) {
    const config::Device device = MakeDevice({ReadPoint("a", "holding 5")});
    Talk talk(ModbusRtuProtocol(), device);
    const Answer answer = Exchange(talk, Poll(0), one.pdu);
    EXPECT_EQ(answer.outcome, one.outcome) << one.pdu;
    EXPECT_EQ(answer.wait, one.wait) << one.pdu;
    EXPECT_NE(answer.reason.find("exception"), std::string::npos);
    ASSERT_EQ(answer.readings.size(), one.quality ? 1U : 0U) << one.pdu;
    if (one.quality) {
      EXPECT_EQ(answer.readings[0].quality, *one.quality) << one.pdu;
    }
  }
}

TEST(ModbusConversation, ARefusedBlockIsReadInParts) {
  const config::Device device = MakeDevice(
      {ReadPoint("a", "holding 0"), ReadPoint("b", "holding 4"), ReadPoint("c", "holding 5")});
  Talk talk(ModbusRtuProtocol(), device);
  ASSERT_EQ(Asked(talk, Poll(0)), "03 00 00 00 06");
  Answer answer = Exchange(talk, Poll(0), "8302");
  EXPECT_EQ(answer.then, Then::replan);
  EXPECT_TRUE(answer.readings.empty()) << "which of them is to blame is not known yet";
  EXPECT_TRUE(answer.divides);
  EXPECT_EQ(answer.remedy, "") << "no point was refused alone";
  EXPECT_EQ(Asked(talk, Poll(0)), "03 00 00 00 01");
  EXPECT_EQ(Asked(talk, Poll(1)), "03 00 04 00 02");
  EXPECT_EQ(Exchange(talk, Poll(0), "03 02 0001").outcome, Outcome::ok);
  EXPECT_EQ(Exchange(talk, Poll(1), "8303").then, Then::replan);
  ASSERT_EQ(talk->Queries().size(), 3U);
  answer = Exchange(talk, Poll(2), "8302");
  EXPECT_EQ(answer.then, Then::replan);
  EXPECT_FALSE(answer.divides);
  EXPECT_NE(answer.remedy, "");
  ASSERT_EQ(answer.readings.size(), 1U);
  EXPECT_EQ(answer.readings[0].point, 2U);
  EXPECT_EQ(answer.readings[0].quality, Quality::bad_configuration);
  EXPECT_EQ(talk->Queries()[2].group, Group::slow);
  EXPECT_EQ(Asked(talk, Poll(2)), "03 00 05 00 01");
  EXPECT_EQ(Exchange(talk, Poll(2), "8302").then, Then::done);
  EXPECT_EQ(Exchange(talk, Poll(2), "03 02 0007").then, Then::replan) << "it is there now";
  EXPECT_EQ(talk->Queries()[2].group, Group::fast);
  talk->OnReconnect();
  EXPECT_EQ(talk->Queries().size(), 1U) << "the device may be another one: blocks are whole again";
}

TEST(ModbusConversation, AnUnansweredBlockIsTreatedAsRefused) {
  const config::Device device = MakeDevice(
      {ReadPoint("a", "holding 0"), ReadPoint("b", "holding 100"), ReadPoint("c", "holding 103")});
  Talk talk(ModbusRtuProtocol(), device);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done) << "the device itself may be away";
  }
  EXPECT_EQ(Exchange(talk, Poll(0), "03 02 0001").outcome, Outcome::ok);
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done);
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done);
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::replan);
  ASSERT_EQ(talk->Queries().size(), 3U);
  EXPECT_EQ(Exchange(talk, Poll(2), "03 02 0001").outcome, Outcome::ok);
  EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::replan) << "a part is suspected already";
  EXPECT_EQ(Asked(talk, Poll(2)), "03 00 64 00 01");
  EXPECT_EQ(talk->Queries()[2].group, Group::slow);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(Exchange(talk, Poll(1), "").then, Then::done);
  EXPECT_EQ(Exchange(talk, Poll(2), "03 02 0001").then, Then::replan) << "it answers after all";
}

TEST(ModbusConversation, AValueBetweenTwoStepsIsReportedInItsUnit) {
  config::Device device = Inverter();
  device.points[2].scale = *Decimal::Parse("0.01");
  device.points[2].unit = "Hz";
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(Asked(talk, Write(2, 3555.5)), "error: point set: 35.555: steps of 0.01 Hz");
  EXPECT_EQ(Asked(talk, Write(2, 70000.0)), "error: point set: 70000 is outside 0...65535");
}

TEST(ModbusConversation, WritesEncodeEachKindOfPoint) {
  const config::Device device = Inverter();
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(Asked(talk, Write(2, 2500.0)), "06 01 2C 09 C4");
  EXPECT_EQ(Asked(talk, Write(2, 2499.9999999)), "06 01 2C 09 C4") << "what a scale leaves";
  EXPECT_EQ(
      Asked(talk, Write(2, 2500.2)),
      "error: point set: 2500.2 is not a whole number, but the register holds whole numbers only");
  EXPECT_EQ(Asked(talk, Write(3, std::uint64_t{2})), "06 00 08 00 02");
  EXPECT_EQ(Asked(talk, Write(4, true)), "16 01 36 FF F7 00 08");
  EXPECT_EQ(Asked(talk, Write(4, false)), "16 01 36 FF F7 00 00");
  EXPECT_EQ(Asked(talk, Write(5, true)), "05 00 04 FF 00");
  EXPECT_EQ(Asked(talk, Write(6, std::uint64_t{65538})), "10 01 40 00 02 04 00 01 00 02");
  EXPECT_NE(Asked(talk, Write(3, std::uint64_t{65536})).find("outside 0...65535"),
            std::string::npos);
  EXPECT_NE(Asked(talk, Write(4, 2.0)).find("neither 0 nor 1"), std::string::npos);
  EXPECT_FALSE(talk->Ask(Write(3, std::uint64_t{2}), Instant{})->expect.repeatable);

  const config::Device other = Inverter({{"write_function", std::string("multiple")}});
  Talk multiple(ModbusRtuProtocol(), other);
  EXPECT_EQ(Asked(multiple, Write(3, std::uint64_t{2})), "10 00 08 00 01 02 00 02");
  EXPECT_EQ(Asked(multiple, Write(5, true)), "0F 00 04 00 01 01 01");
}

TEST(ModbusConversation, AWriteIsConfirmedByItsRepeatedContent) {
  const config::Device device = Inverter();
  Talk talk(ModbusRtuProtocol(), device);
  const Task task = Write(3, std::uint64_t{2});
  const Request request = *talk->Ask(task, Instant{});
  const auto outcome = [&](const char* pdu) {
    return talk->OnFrame(task, request, Wrap(Framing::rtu, 20, Hex(pdu)), Instant{}).outcome;
  };
  EXPECT_EQ(outcome("0600080002"), Outcome::ok);
  EXPECT_EQ(outcome("0600080000"), Outcome::unexpected);
  EXPECT_EQ(outcome("0600090002"), Outcome::unexpected);
  EXPECT_EQ(outcome("8601"), Outcome::unsupported);
  EXPECT_EQ(outcome("8602"), Outcome::refused);
  EXPECT_EQ(outcome("8603"), Outcome::refused);
  EXPECT_EQ(outcome("8604"), Outcome::refused);
  EXPECT_EQ(outcome("8606"), Outcome::busy);
}

constexpr const char* kLoopback = "08 00 00 A5 5A";

config::Device ByLoopback(std::vector<config::Point> points) {
  return MakeDevice(std::move(points), {{"probe", std::string("loopback")}});
}

/// Polls read one register, the probe two. So a late reply to a poll does not fit the probe.
TEST(ModbusProbe, ReadsALengthThatNoPollUses) {
  const config::Device device = MakeDevice({ReadPoint("a", "holding 5")});
  Talk talk(ModbusRtuProtocol(), device);
  const auto request = talk->Ask(Probe(), Instant{});
  ASSERT_TRUE(request);
  EXPECT_TRUE(request->unlike_polls);
  EXPECT_FALSE(request->steady);
  EXPECT_EQ(Asked(talk, Probe()), "03 00 05 00 02");
  EXPECT_EQ(Exchange(talk, Probe(), "03 04 0001 0002").outcome, Outcome::ok);
  const Answer answer = Exchange(talk, Probe(), "8302");
  EXPECT_EQ(answer.outcome, Outcome::ok) << "two registers may not be there, but the device is";
  EXPECT_TRUE(answer.readings.empty()) << "a poll says what is wrong with the point";
}

/// A refusal can answer any request, so it proves nothing.
TEST(ModbusProbe, TriesTheNextReadAfterARefusal) {
  const config::Device device = MakeDevice(
      {ReadPoint("a", "holding 0"), ReadPoint("b", "holding 50"), ReadPoint("c", "input 7")});
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(Asked(talk, Probe()), "03 00 00 00 02");
  for (int copy = 0; copy < 2; ++copy) {
    const Answer answer = talk.Reply(Probe(), talk.protocol().carrier->wrap(kSlave, Hex("8302")));
    EXPECT_EQ(answer.outcome, Outcome::ok);
    EXPECT_EQ(answer.then, Then::ask_again);
  }
  EXPECT_EQ(Asked(talk, Probe()), "03 00 32 00 02");
  EXPECT_EQ(Exchange(talk, Probe(), "03 04 0001 0002").then, Then::done);
  EXPECT_EQ(Asked(talk, Probe()), "03 00 32 00 02") << "it is answered";
  EXPECT_EQ(Exchange(talk, Probe(), "8302").then, Then::ask_again);
  EXPECT_EQ(Asked(talk, Probe()), "04 00 07 00 02");
  EXPECT_EQ(Exchange(talk, Probe(), "8402").then, Then::done) << "all are refused";
  EXPECT_EQ(Asked(talk, Probe()), "03 00 00 00 02");
}

/// The longest poll is the probe here, because a device can refuse registers beyond the polled
/// registers.
TEST(ModbusProbe, ReadsNoFurtherRegistersIfAPollIsLongEnough) {
  const config::Device device =
      MakeDevice({ReadPoint("a", "holding 0"), ReadPoint("b", "holding 50", config::Type::float32),
                  ReadPoint("c", "holding 100", config::Type::float64)});
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(Asked(talk, Probe()), "03 00 64 00 03");
}

TEST(ModbusProbe, IsALoopbackWithoutReads) {
  const config::Device device = MakeDevice({WritePoint("a", "", "holding 5")});
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(Asked(talk, Probe()), kLoopback);
}

TEST(ModbusProbe, RepeatsTheSameLoopback) {
  const config::Device device = ByLoopback({ReadPoint("a", "holding 5")});
  Talk talk(ModbusRtuProtocol(), device);
  const auto request = talk->Ask(Probe(), Instant{});
  ASSERT_TRUE(request);
  EXPECT_TRUE(request->steady);
  EXPECT_TRUE(request->expect.mirrors);
  EXPECT_TRUE(request->expect.repeatable);
  EXPECT_EQ(Asked(talk, Probe()), kLoopback);
  EXPECT_EQ(Exchange(talk, Probe(), kLoopback).outcome, Outcome::ok);
  EXPECT_EQ(Exchange(talk, Probe(), "8801").outcome, Outcome::ok) << "it speaks, that is enough";
  EXPECT_EQ(Asked(talk, Probe()), kLoopback);
}

TEST(ModbusProbe, FindsADeviceThatIgnoresLoopbacksByARead) {
  const config::Device device = ByLoopback({ReadPoint("a", "holding 5")});
  Talk talk(ModbusRtuProtocol(), device);
  for (int round = 0; round < 3; ++round) {
    EXPECT_EQ(Asked(talk, Probe()), kLoopback) << round;
    EXPECT_EQ(Exchange(talk, Probe(), "").outcome, Outcome::no_reply);
    EXPECT_EQ(Asked(talk, Probe()), "03 00 05 00 01");
    EXPECT_FALSE(talk->Ask(Probe(), Instant{})->unlike_polls);
    EXPECT_EQ(Exchange(talk, Probe(), "03 02 0001").outcome, Outcome::ok);
  }
  EXPECT_EQ(Asked(talk, Probe()), "03 00 05 00 01") << "it does not know the loopback";
  talk->OnReconnect();
  EXPECT_EQ(Asked(talk, Probe()), kLoopback) << "it may be another device now";
}

TEST(ModbusProbe, FindsADeviceThatIgnoresProbesByAPoll) {
  const config::Device device = MakeDevice({ReadPoint("a", "holding 5")});
  Talk talk(ModbusRtuProtocol(), device);
  for (int round = 0; round < 3; ++round) {
    EXPECT_EQ(Asked(talk, Probe()), "03 00 05 00 02") << round;
    EXPECT_EQ(Exchange(talk, Probe(), "").outcome, Outcome::no_reply);
    EXPECT_EQ(Asked(talk, Probe()), "03 00 05 00 01");
    EXPECT_EQ(Exchange(talk, Probe(), "03 02 0001").outcome, Outcome::ok);
  }
  EXPECT_EQ(Asked(talk, Probe()), "03 00 05 00 01");
}

TEST(ModbusProbe, TreatsAGatewayExceptionAsNoReply) {
  const config::Device device = MakeDevice({ReadPoint("a", "holding 5")});
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(Exchange(talk, Probe(), "830B").outcome, Outcome::no_reply);
}

TEST(ModbusProbe, AlternatesReadsWhenABlockIsNeverAnswered) {
  const config::Device device =
      MakeDevice({ReadPoint("a", "holding 0"), ReadPoint("b", "holding 100")});
  Talk talk(ModbusRtuProtocol(), device);
  std::vector<std::string> asked;
  for (int i = 0; i < 4; ++i) {
    asked.push_back(Asked(talk, Probe()));
    Exchange(talk, Probe(), "");
  }
  EXPECT_EQ(asked, (std::vector<std::string>{"03 00 00 00 02", "03 00 64 00 01", "03 00 00 00 02",
                                             "03 00 00 00 01"}));
}

TEST(ModbusDecode, NamesPointsAndLabelsOtherRegisters) {
  const config::Device device = Inverter();
  Talk talk(ModbusRtuProtocol(), device);
  const Bytes request = Wrap(Framing::rtu, 20, Hex("0300C80003"));
  const Answer answer =
      talk->Interpret(request, Wrap(Framing::rtu, 20, Hex("0306 09C4 00CA 0007")));
  EXPECT_EQ(answer.outcome, Outcome::ok);
  ASSERT_EQ(answer.readings.size(), 3U);
  EXPECT_EQ(answer.readings[1].point, 1U);
  EXPECT_EQ(answer.readings[2].point, kNoPoint);
  EXPECT_EQ(answer.readings[2].label, "holding 202");
  EXPECT_EQ(answer.readings[2].value, Value(std::uint64_t{7}));
  const Answer coils = talk->Interpret(Wrap(Framing::rtu, 20, Hex("0100000003")),
                                       Wrap(Framing::rtu, 20, Hex("010105")));
  ASSERT_EQ(coils.readings.size(), 3U);
  EXPECT_EQ(coils.readings[2].label, "coil 2");
  EXPECT_EQ(coils.readings[2].value, Value(true));
  const Answer both = talk->Interpret(Wrap(Framing::rtu, 20, Hex("1700C80001000A0001020005")),
                                      Wrap(Framing::rtu, 20, Hex("170209C4")));
  ASSERT_EQ(both.readings.size(), 1U);
  EXPECT_EQ(both.readings[0].point, 0U);
}

TEST(ModbusDecode, AcceptsAnySlaveAndRefusesDamagedFrames) {
  const config::Device device = Inverter();
  Talk talk(ModbusRtuProtocol(), device);
  EXPECT_EQ(talk->Interpret(Wrap(Framing::rtu, 7, Hex("0600080002")),
                            Wrap(Framing::rtu, 7, Hex("0600080002")))
                .outcome,
            Outcome::ok);
  EXPECT_EQ(talk->Interpret(Hex("140300"), Hex("1403021234")).outcome, Outcome::corrupt);
  EXPECT_EQ(talk->Interpret(Wrap(Framing::rtu, 0, Hex("0600080002")),
                            Wrap(Framing::rtu, 0, Hex("0600080002")))
                .outcome,
            Outcome::unexpected);
  EXPECT_EQ(talk->Interpret({}, {}).outcome, Outcome::corrupt);
}

TEST(ModbusTiming, SilenceIsThreeAndAHalfCharacters) {
  config::SerialSettings serial = ModbusRtuProtocol().serial;
  EXPECT_EQ(serial.ToString(), "19200 8E1");
  EXPECT_EQ(ModbusAsciiProtocol().serial.ToString(), "9600 7E1");
  EXPECT_EQ(*ModbusRtuProtocol().timing(serial).quiet, serial.CharacterTime() * 7 / 2);
  serial.baud = 115200;
  EXPECT_EQ(*ModbusRtuProtocol().timing(serial).quiet, 1750us);
  for (const int baud : {300, 9600, 19200, 115200, 921600}) {
    serial.baud = baud;
    for (const Framing framing : {Framing::rtu, Framing::ascii}) {
      const config::Timing timing = ProtocolOf(framing).timing(serial);
      EXPECT_GT(*timing.ceiling, *timing.reply + 256 * serial.CharacterTime());
      EXPECT_GE(*timing.gap, 50ms);
      EXPECT_GE(*timing.drain, *timing.gap);
    }
  }
}

}  // namespace
}  // namespace baudgate::protocols::modbus
