// The DCON twin: answers like the module, is silent like the module.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/twin.h"

#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Type;

std::string Say(Twin& twin, const config::Device& device, std::string_view request) {
  const Bytes reply = AskTwin(DconProtocol(), twin, device.options, ToBytes(request));
  return std::string(AsText(reply));
}

TEST(DconTwinTest, AnswersTheWorkedExample) {
  const config::Device device = EightInputs();
  FixedValues values;
  values.values = {{0, 100.23},  {1, 34.050}, {2, 124.56},  {3, 7.331},
                   {4, -101.45}, {5, 1038.9}, {6, -50.501}, {7, 5.880}};
  DconTwin twin(device, values);
  EXPECT_EQ(Say(twin, device, "#0184\r"),
            ">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880FC\r");
  EXPECT_EQ(Say(twin, device, "#017BB\r"), AsText(BuildReply(">+05.880", true)));
}

TEST(DconTwinTest, SilentLikeTheModule) {
  const config::Device device = EightInputs();
  FixedValues values;
  DconTwin twin(device, values);
  EXPECT_EQ(Say(twin, device, "#01\r"), "") << "no checksum";
  EXPECT_EQ(Say(twin, device, "#0185\r"), "") << "wrong checksum";
  EXPECT_EQ(Say(twin, device, "#0285\r"), "") << "another module";
  EXPECT_EQ(Say(twin, device, "#**77\r"), "") << "broadcast";
  EXPECT_EQ(Say(twin, device, AsText(BuildRequest("$M", 1, true))), "") << "OWEN has no name";
  EXPECT_EQ(Say(twin, device, AsText(BuildRequest("#8", 1, true))), "") << "no such channel";
}

TEST(DconTwinTest, NamesItselfAndRefusesWhereItIsThatKind) {
  const config::Device device = MakeDevice({ReadPoint("a", "#[0]")}, {{"identify", true}});
  FixedValues values;
  DconTwin twin(device, values);
  EXPECT_EQ(Say(twin, device, "$01M\r"), "!01TWIN\r");
  EXPECT_EQ(Say(twin, device, "$012\r"), "!01400600\r");
  EXPECT_EQ(Say(twin, device, "#019\r"), "?01\r");
  EXPECT_EQ(Say(twin, device, "$01Z\r"), "");
}

TEST(DconTwinTest, RepliesUnderAnotherAddressWhereItsRepliesCarryOne) {
  const config::Device device = MakeDevice({ReadPoint("a", "#[0]")}, {{"identify", true}});
  FixedValues values;
  values.values = {{0, 1.5}};
  DconTwin twin(device, values);
  const std::string data = Say(twin, device, "#010\r");
  twin.ReplyAs("31");
  EXPECT_EQ(Say(twin, device, "$01M\r"), "!1FTWIN\r");
  EXPECT_EQ(Say(twin, device, "#019\r"), "?1F\r");
  EXPECT_EQ(Say(twin, device, "#010\r"), data) << "data carry no address";
  EXPECT_EQ(Say(twin, device, "$1FM\r"), "") << "it is still called 01";
}

TEST(DconTwinTest, DigitalOutputsFollowWrites) {
  std::vector<config::Point> points;
  for (int i = 0; i < 4; ++i) {
    const std::string n = std::to_string(i);
    points.push_back(WritePoint("relay_" + n, "$6[b" + std::to_string(8 + i) + "]",
                                "#1" + n + "{bit}", Type::boolean));
  }
  points.push_back(ReadPoint("input", "$6[b0]", Type::boolean));
  const config::Device device = MakeDevice(points);
  FixedValues values;
  values.values[4] = true;
  DconTwin twin(device, values);
  EXPECT_EQ(Say(twin, device, "$016\r"), "!000100\r");
  EXPECT_EQ(Say(twin, device, "#011201\r"), ">\r");
  EXPECT_EQ(Say(twin, device, "$016\r"), "!040100\r");
  EXPECT_EQ(Say(twin, device, "@01\r"), ">0401\r");
  EXPECT_EQ(Say(twin, device, "#011202\r"), "?01\r");
  EXPECT_EQ(Say(twin, device, "#011501\r"), "") << "no such output";
  EXPECT_EQ(values.values[2], Value{true});

  Talk talk(DconProtocol(), device);
  const Answer answer = talk.Run(Write(0, true), twin);
  EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
  EXPECT_EQ(Say(twin, device, "$016\r"), "!050100\r");
}

TEST(DconTwinTest, InvertedInputsRoundTrip) {
  const config::Device device =
      MakeDevice({ReadPoint("a", "@[b0]", Type::boolean)}, {{"invert", std::int64_t{15}}});
  FixedValues values;
  values.values[0] = true;
  DconTwin twin(device, values);
  EXPECT_EQ(Say(twin, device, "@01\r"), ">000E\r");
  Talk talk(DconProtocol(), device);
  EXPECT_EQ(talk.Run(Poll(0), twin).readings[0].value, Value{true});
}

TEST(DconTwinTest, AnalogOutputsFollowWritesWithinRange) {
  const config::Device device =
      MakeDevice({WritePoint("volts", "$82", "#2{+00.000 0..10}")}, {{"checksum", true}}, "11");
  FixedValues values;
  DconTwin twin(device, values);
  EXPECT_EQ(Say(twin, device, "#0B2+07.5001C\r"), ">3E\r");
  EXPECT_EQ(Say(twin, device, AsText(BuildRequest("$82", 11, true))), "!0B+07.500E8\r");
  EXPECT_EQ(Say(twin, device, AsText(BuildRequest("#2+12.000", 11, true))),
            AsText(BuildReply("?0B", true)));
  EXPECT_EQ(values.values[0], Value{7.5});
}

TEST(DconTwinTest, CounterWithChecksumInFront) {
  const config::Device device =
      MakeDevice({ReadPoint("count", "#0 counter", Type::uint32)},
                 {{"checksum", true}, {"counter_checksum", std::string("front")}});
  FixedValues values;
  values.values[0] = std::uint64_t{30};
  DconTwin twin(device, values);
  EXPECT_EQ(Say(twin, device, "#010B4\r"), ">D40000001E\r");
  Talk talk(DconProtocol(), device);
  EXPECT_EQ(talk.Run(Poll(0), twin).readings[0].value, Value{std::uint64_t{30}});
}

TEST(DconTwinTest, DisabledChannelsInEveryManner) {
  for (const std::string manner : {"missing", "blank", "zero"}) {
    const config::Device device =
        EightInputs({{"enable_mask", std::int64_t{0xF0}}, {"disabled", manner}});
    FixedValues values;
    for (std::size_t i = 0; i < 8; ++i) values.values[i] = static_cast<double>(i);
    DconTwin twin(device, values);
    Talk talk(DconProtocol(), device);
    const Answer answer = talk.Run(Poll(0), twin);
    ASSERT_EQ(answer.outcome, Outcome::ok) << manner << ": " << answer.reason;
    ASSERT_EQ(answer.readings.size(), 8U);
    for (const Reading& reading : answer.readings) {
      const bool enabled = reading.point >= 4;
      EXPECT_EQ(reading.quality, enabled ? Quality::good : Quality::bad_out_of_service) << manner;
      EXPECT_EQ(HasValue(reading.value), enabled);
    }
  }
}

TEST(DconTwinTest, FaultsAndValuesBeyondTheFieldAreCodes) {
  const config::Device device = MakeDevice({ReadPoint("a", "#[0]"), ReadPoint("b", "#[1]"),
                                            ReadPoint("c", "#[2]"), ReadPoint("d", "#[3]")});
  FixedValues values;
  values.values = {{0, std::string("+99999")}, {1, 123456.0}, {2, -1e9}, {3, Value{}}};
  DconTwin twin(device, values);
  Talk talk(DconProtocol(), device);
  for (const Reading& reading : talk.Run(Poll(0), twin).readings) {
    EXPECT_EQ(reading.quality, Quality::bad_sensor_failure);
    EXPECT_FALSE(HasValue(reading.value));
  }
}

}  // namespace
}  // namespace baudgate::protocols::dcon
