// What the gateway asks a SET-4TM meter, and which frames are its answers.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/conversation.h"

#include <gmock/gmock.h>

#include "protocols/set4tm/meter/codec.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using config::Group;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

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

/// C8 03 09 30 C8 and a zero: two bytes of data, or three: C8 00 is the CRC of 03 09 30 too.
TEST(Set4tmCheck, AFrameBeforeAZeroMayAnswerWhoAwaitsOneByteMore) {
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
  // The right one is asked once.
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
