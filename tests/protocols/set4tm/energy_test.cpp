// Constants of a SET-4TM meter, without which its counts are no energy.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "protocols/set4tm/conversation.h"
#include "protocols/set4tm/meter/codec.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using config::Group;
using ::testing::ElementsAre;

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
