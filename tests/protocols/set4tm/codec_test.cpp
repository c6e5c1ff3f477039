// Tests SET-4TM addresses, passwords, checksums and lengths with examples of the reference.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/plan.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

TEST(Set4tmAddress, ParsesShortExtendedAndSerialAddresses) {
  EXPECT_EQ(*ParseAddress("0"), Hex("00"));
  EXPECT_EQ(*ParseAddress("200"), Hex("C8"));
  EXPECT_EQ(*ParseAddress("239"), Hex("EF"));
  EXPECT_EQ(*ParseAddress("255"), Hex("FF"));
  EXPECT_EQ(*ParseAddress("256"), Hex("FC 00 00 01 00"));
  EXPECT_EQ(*ParseAddress("9020001"), Hex("FC 00 89 A2 61"));
  EXPECT_EQ(*ParseAddress("sn:200"), Hex("FC 00 00 00 C8"));
  EXPECT_EQ(*ParseAddress("4294967295"), Hex("FC FF FF FF FF"));
}

TEST(Set4tmAddress, RefusesReservedAndMalformedAddressesWithAReason) {
  for (const char* text : {"240", "251", "252", "253", "254", "-1", "", "C8", "4294967296", "1 "}) {
    EXPECT_FALSE(ParseAddress(text)) << text;
  }
  EXPECT_NE(ParseAddress("254").error().find("broadcast"), std::string::npos);
  EXPECT_NE(ParseAddress("245").error().find("sn:245"), std::string::npos);
}

TEST(Set4tmPassword, MayBeTextOrHex) {
  EXPECT_EQ(*ParsePassword("000000"), Hex("30 30 30 30 30 30"));
  EXPECT_EQ(*ParsePassword("hex:01 02 03 04 05 06"), Hex("01 02 03 04 05 06"));
  for (const char* text : {"", "00000", "0000000", "hex:01 02", "hex:0102030405zz"}) {
    EXPECT_FALSE(ParsePassword(text)) << text;
  }
}

TEST(Set4tmChecksum, IsCrc16LowByteFirst) {
  EXPECT_EQ(Crc16(ToBytes("123456789")), 0x4B37);
  EXPECT_EQ(MakeFrame(Hex("00"), Hex("00")), Hex("00 00 01 B0"));
  EXPECT_FALSE(EndsInCrc16(Hex("00 00 B0 01")));
  EXPECT_FALSE(SplitFrame(Hex("FC 00 01 B0")));
  EXPECT_FALSE(SplitFrame(Bytes()));
}

struct Vector {
  const char* address;
  const char* pdu;
  const char* request;
  const char* reply;
};

/// Worked examples 1 to 18 of the reference. If the reference does not print a reply, the reply is
/// empty here.
constexpr Vector kVectors[] = {
    {"1", "00", "01 00 00 20", "01 00 00 20"},
    {"200", "01 30 30 30 30 30 30", "C8 01 30 30 30 30 30 30 03 D2", "C8 00 56 70"},
    {"200", "08 1B 00 11", "C8 08 1B 00 11 77 BB", "C8 00 80 66 43 AE 69"},
    {"5", "01 30 30 30 30 30 30", "05 01 30 30 30 30 30 30 CE 1B", "05 00 02 E0"},
    {"83", "01 30 30 30 30 30 30", "53 01 30 30 30 30 30 30 4B 0D", "53 00 3D 40"},
    {"0", "08 11 19", "00 08 11 19 4C 7C", "00 00 01 37 40 62"},
    {"5", "08 00", "05 08 00 66 01", "05 00 89 A2 61 06 09 02 1E D8"},
    {"5", "04 00", "05 04 00 63 01", "05 31 30 15 01 02 09 02 00 28 A4"},
    {"5", "09 00 00", "05 09 00 00 D0 EA", "05 31 30 15 01 02 09 02 00 28 A4"},
    {"5", "05 00 02", "05 05 00 02 91 28",
     "05 00 00 27 11 00 00 00 00 00 00 13 89 00 00 00 65 67 40"},
    {"5", "0A 00 00 02 0F 00", "05 0A 00 00 02 0F 00 EA 9A",
     "05 00 00 27 11 00 00 00 00 00 00 13 89 00 00 00 65 67 40"},
    {"5", "08 1B 00 00", "05 08 1B 00 00 9A 67", "05 08 FF 47 44 E9 93"},
    {"5", "08 11 00", "05 08 11 00 8D 7A", "05 44 2F 47 1C FF"},
    {"5", "08 04", "05 08 04 67 C2", "05 35 11 08 09 99 06 58 D6 5E"},
    {"5", "06 03 00 00 07", "05 06 03 00 00 07 C9 C8", "05 14 14 08 02 00 02 34 37 EF"},
    {"5", "03 0B 00 0A", "05 03 0B 00 0A 19 81", "05 04 03 23"},
    {"5", "08 00", "05 08 00 66 01", "05 05 C2 E3"},
    {"9020001", "08 00", "FC 00 89 A2 61 08 00 8F 76", "FC 00 89 A2 61 00 89 A2 61 06 09 02 58 BB"},
    {"5", "08 23 A5 00 00 00 10 00 0E 0E FF FF", "05 08 23 A5 00 00 00 10 00 0E 0E FF FF 3C 2C",
     ""},
    {"5", "08 23 15 00 00 00 00 00 02 00 00 03", "05 08 23 15 00 00 00 00 00 02 00 00 03 1A 89",
     "05 15 00 50 5A 44 C2 F5 D6 41 60 E5 A0 40 CC 8A"},
};

TEST(Set4tmFrames, WorkedExamplesAreEncodedAndCutAsPrinted) {
  for (const Vector& vector : kVectors) {
    const Bytes request = MakeFrame(*ParseAddress(vector.address), Hex(vector.pdu));
    EXPECT_EQ(ToHex(request), vector.request);
    EXPECT_EQ(CutFrame(Set4tmProtocol().request_rule, Expect({}, DefaultSettings()), request),
              request);
    if (*vector.reply == '\0') continue;
    EXPECT_EQ(ToHex(CutFrame(Set4tmProtocol().reply_rule, Expect(request, DefaultSettings()),
                             Hex(vector.reply))),
              vector.reply);
  }
}

TEST(Set4tmLengths, MatchTheReference) {
  const std::pair<const char*, std::size_t> kLengths[] = {
      {"08 00", 7},
      {"08 02", 10},
      {"08 05", 2},
      {"08 05 01", 4},
      {"08 0A", 5},
      {"08 0A 01", 32},
      {"08 0A 02", 4},
      {"08 0B", 16},
      {"08 14 F0", 16},
      {"08 14 50", 7},
      {"08 14 11", 3},
      {"08 16 00", 12},
      {"08 18 00", 5},
      {"08 18 03", 4},
      {"08 1B 02 00", 16},
      {"08 1B 01 00", 4},
      {"04 00", 8},
      {"04 19", 14},
      {"09 01 09", 14},
      {"09 05 09", 7},
      {"05 00 00", 16},
      {"0A 00 00 00 FF 00", 32},
      {"06 03 00 00 5D", 93},
      {"0C 01 03 00 00 5C", 93},
      {"08 23 A5 00 00 00 10 00 0E 0E FF FF", 93},
      {"08 23 00 00 80 00 00 00 00 00 00 01", 13},
      {"08 24", 32},
  };
  for (const auto& [pdu, length] : kLengths) EXPECT_EQ(LengthOfData(Hex(pdu)), length) << pdu;
}

TEST(Set4tmLengths, AreUnknownForUndocumentedRequests) {
  for (const char* pdu : {"", "08", "08 7F", "08 1B 00", "00", "01 30 30 30 30 30 30",
                          "03 0B 00 0A", "0A 00 00 00 00 00", "08 23 00 00 00 00 00 00 00 00 00 00",
                          "06 03 00 00 01", "06 03 00 00 FF", "09 46 00", "08 18 09"}) {
    EXPECT_FALSE(LengthOfData(Hex(pdu))) << pdu;
  }
}

TEST(Set4tmExpect, HidesThePasswordAndMarksRepeatableRequests) {
  const Expectation open = Expect(Hex("C8 01 30 30 30 30 30 30 03 D2"), DefaultSettings());
  ASSERT_EQ(open.secrets.size(), 1U);
  EXPECT_EQ(open.secrets[0], (std::pair<std::size_t, std::size_t>{2, 8}));
  EXPECT_TRUE(open.repeatable);
  const Bytes extended = MakeFrame(ExtendedAddress(9020001), Hex("01 30 30 30 30 30 30"));
  EXPECT_EQ(Expect(extended, DefaultSettings()).secrets[0].first, 6U);
  EXPECT_FALSE(Expect(Hex("05 03 0B 00 0A 19 81"), DefaultSettings()).repeatable);
  EXPECT_TRUE(Expect(Hex("05 08 00 66 01"), DefaultSettings()).repeatable);
  const Bytes broadcast = MakeFrame(Hex("FE"), Hex("03 08 55 AA 33 CC"));
  EXPECT_EQ(Expect(broadcast, DefaultSettings()).reply, Expectation::Reply::none);
}

TEST(Set4tmProtocolTest, DescriptorIsComplete) {
  const Protocol& protocol = Set4tmProtocol();
  EXPECT_EQ(protocol.name, "set4tm");
  EXPECT_EQ(protocol.serial.ToString(), "9600 8O1");
  const config::Timing timing = protocol.timing(protocol.serial);
  // Seven characters of eleven bits at 9600 bit/s: the 8 ms of the reference.
  EXPECT_GE(*timing.quiet, 8ms);
  EXPECT_LT(*timing.quiet, 9ms);
  EXPECT_EQ(*timing.reply, 300ms);
  EXPECT_EQ(*timing.gap, 50ms);
  EXPECT_EQ(*timing.drain, 150ms);
  EXPECT_GT(*timing.ceiling, *timing.reply + 96 * protocol.serial.CharacterTime());
  config::SerialSettings slow = protocol.serial;
  slow.baud = 300;
  EXPECT_GT(*protocol.timing(slow).gap, 2 * slow.CharacterTime());
  bool secret = false;
  for (const OptionSpec& option : protocol.options)
    secret |= option.name == "password" && option.secret;
  EXPECT_TRUE(secret);
  EXPECT_TRUE(protocol.canonical_address("200"));
  EXPECT_FALSE(protocol.canonical_address("254"));
}

using config::Group;
using config::Type;

TEST(Set4tmDecode, ValuesWithoutAPointCarryALabel) {
  config::Device device = MakeDevice("5", {});
  MeterBus bus;
  MeterConversation conversation(device, ReadSettings(device.options), bus);
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
  MeterBus bus;
  MeterConversation conversation(device, ReadSettings(device.options), bus);
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

std::string IntegerOf(std::string_view read) {
  const auto field = ParseField(read);
  if (!field) return field.error();
  const auto integer = AsInteger(*field);
  return integer ? FieldText(*integer) : "";
}

/// SET-4TM reference, 9.5 to 9.7: the integer request has the parameter byte of the float request.
/// Its reply has four values of three bytes.
TEST(Set4tmIntegers, UseTheSameParameterAsFloats) {
  EXPECT_EQ(IntegerOf("08 1B 02 00 float_le@0"), "08 16 00 power_be@0");
  EXPECT_EQ(IntegerOf("08 1B 02 00 float_le@12"), "08 16 00 power_be@9");
  EXPECT_EQ(IntegerOf("08 1B 02 04 float_le@4"), "08 16 04 reactive_be@3");
  EXPECT_EQ(IntegerOf("08 1B 02 08 float_le@0"), "08 16 08 apparent_be@0");
  EXPECT_EQ(IntegerOf("08 1B 02 10 float_le@4"), "08 16 10 voltage_be@3");
  EXPECT_EQ(IntegerOf("08 1B 02 20 float_le@8"), "08 16 20 current_be@6");
  EXPECT_EQ(IntegerOf("08 1B 02 30 float_le@0"), "08 16 30 factor_be@0");
  EXPECT_EQ(IntegerOf("08 1B 00 40 float_le@0"), "08 11 40 hundredths_be@0");
  EXPECT_EQ(IntegerOf("08 1B 00 11 float_le@0"), "08 11 11 voltage_be@0");
  EXPECT_EQ(IntegerOf("08 1B 02 84 float_le@4"), "08 16 84 hundredths_be@3");
  EXPECT_EQ(IntegerOf("08 1B 00 70 float_le@0"), "08 01 i8@1");
}

TEST(Set4tmIntegers, ReplaceOnlyLiveFloats) {
  EXPECT_EQ(IntegerOf("08 1B 01 11 float_le@0"), "") << "latched";
  EXPECT_EQ(IntegerOf("08 16 10 voltage_be@3"), "");
  EXPECT_EQ(IntegerOf("05 00 00 energy@0"), "");
}

using ::testing::ElementsAre;

TEST(Set4tmEnergy, OptionsReplaceTheConstantsOfTheMeter) {
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

TEST(Set4tmDecode, LearnsConstantsFromTheCapture) {
  config::Device device = MakeDevice("5", {MakePoint("05 00 02 energy@0")});
  MeterBus bus;
  MeterConversation conversation(device, ReadSettings(device.options), bus);
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

}  // namespace
}  // namespace baudgate::protocols::set4tm
