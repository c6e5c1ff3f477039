// What is made of captured replies, whose values belong to no point, and of random ones.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/codec.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

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

}  // namespace
}  // namespace baudgate::protocols::set4tm
