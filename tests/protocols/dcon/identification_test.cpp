// Tests the identification of a module before it is polled: name, checksum mode, channels.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/twin.h"
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

using config::Group;
using config::Type;

config::Point Volts(const std::string& name, const std::string& read) {
  config::Point point = ReadPoint(name, read);
  point.unit = "V";
  return point;
}

config::Device TwoInputs(Settable options = {}) {
  options.insert(options.begin(), {"identify", true});
  return MakeDevice({Volts("a", "#[0]"), Volts("b", "#[1]")}, options);
}

class Script {
 public:
  explicit Script(config::Device device)
      : device_(std::move(device)), talk_(DconProtocol(), device_) {}

  Answer Run(const Task& task, const std::vector<std::pair<std::string, std::string>>& lines) {
    Answer answer;
    answer.then = Then::ask_again;
    for (const auto& [request, reply] : lines) {
      EXPECT_EQ(answer.then, Then::ask_again) << "before " << request;
      EXPECT_EQ(Asked(talk_, task), request + "\r");
      answer = Exchange(talk_, task, reply.empty() ? "" : reply + "\r");
    }
    return answer;
  }
  Talk& talk() { return talk_; }
  const DeviceTrouble& trouble() { return talk_->trouble(); }

 private:
  config::Device device_;
  Talk talk_;
};

TEST(DconIdentification, ReadsNameTypeAndMaskBeforeTheFirstPoll) {
  Script script(TwoInputs());
  const Answer answer = script.Run(
      Poll(0),
      {{"$01M", "!017017"}, {"$012", "!01080600"}, {"$016", "!01FF"}, {"#01", ">+05.000+06.000"}});
  EXPECT_EQ(answer.then, Then::done);
  EXPECT_EQ(answer.readings.size(), 2U);
  EXPECT_FALSE(script.trouble());
  script.Run(Poll(0), {{"#01", ">+05.000+06.000"}});
  script.talk()->OnReconnect();
  script.Run(Poll(0), {{"$01M", "!017017"}});
}

TEST(DconIdentification, APercentModuleIsNeverServedAsVolts) {
  Script script(TwoInputs());
  const Answer answer = script.Run(Poll(0), {{"$01M", "!017017"}, {"$012", "!01080601"}});
  EXPECT_EQ(answer.then, Then::replan);
  EXPECT_EQ(script.trouble().reason, Reason::other_module);
  EXPECT_NE(script.trouble().text.find("data format is 'percent', but the profile has engineering"),
            std::string::npos)
      << script.trouble().text;
  ASSERT_EQ(script.talk()->Queries().size(), 1U);
  EXPECT_EQ(script.talk()->Queries()[0].group, Group::slow) << "is it right by now?";
  script.Run(Poll(0), {{"$01M", "!017017"}, {"$012", "!01080601"}});
  script.talk()->OnReconnect();
  EXPECT_TRUE(script.trouble()) << "until it is known to be right";
  const Answer mended = script.Run(Poll(0), {{"$01M", "!017017"}, {"$012", "!01080600"}});
  EXPECT_EQ(mended.then, Then::replan);
  EXPECT_FALSE(script.trouble());
  EXPECT_EQ(script.talk()->Queries()[0].group, Group::fast);
}

TEST(DconIdentification, TypeFormatAndChecksumAreCompared) {
  const std::pair<const char*, const char*> kCases[] = {
      {"!010D0600", "type 0D measures in mA, but the profile has V for a"},
      {"!01080640", "the module's checksum is on, but the configuration has checksum: false"},
      {"!01080602", "data format is 'hex'"},
  };
  for (const auto& [reply, text] : kCases) {
    Script script(TwoInputs());
    script.Run(Poll(0), {{"$01M", ""}, {"$012", reply}});
    EXPECT_NE(script.trouble().text.find(text), std::string::npos) << script.trouble().text;
  }
  Script listed(TwoInputs({{"types", std::vector<std::string>{"08", "09"}}}));
  listed.Run(Poll(0), {{"$01M", "!017017"}, {"$012", "!010A0600"}});
  EXPECT_NE(listed.trouble().text.find("type 0A, but the profile has 08 or 09"), std::string::npos)
      << listed.trouble().text;
}

TEST(DconIdentification, MayBeIgnored) {
  config::Device device = TwoInputs();
  device.identity.ignore = true;
  Script script(device);
  script.Run(
      Poll(0),
      {{"$01M", "!017017"}, {"$012", "!010D0601"}, {"$016", "!0103"}, {"#01", ">+05.000+06.000"}});
  EXPECT_FALSE(script.trouble());
}

TEST(DconIdentification, MillivoltsAreConvertedToTheUnitOfThePoint) {
  Script script(TwoInputs());
  const Answer answer = script.Run(
      Poll(0),
      {{"$01M", "!017017"}, {"$012", "!010B0600"}, {"$016", "!0103"}, {"#01", ">+500.00-250.00"}});
  ASSERT_EQ(answer.readings.size(), 2U);
  EXPECT_DOUBLE_EQ(ToDouble(answer.readings[0].value), 0.5);
  EXPECT_DOUBLE_EQ(ToDouble(answer.readings[1].value), -0.25);
}

TEST(DconIdentification, TheChannelMaskAssignsTheChannels) {
  config::Device device = EightInputs({{"identify", true}, {"checksum", false}});
  Script script(device);
  const Answer answer =
      script.Run(Poll(0), {{"$01M", "!014017P"},
                           {"$012", "!01080600"},
                           {"$016", "!01FE"},
                           {"#01", ">+01.000+02.000+03.000+04.000+05.000+06.000+07.000"}});
  ASSERT_EQ(answer.readings.size(), 8U) << answer.reason;
  EXPECT_EQ(answer.readings[0].quality,
            Quality(Quality::bad_out_of_service, Reason::channel_disabled));
  EXPECT_EQ(answer.readings[1].value, Value{1.0});
  EXPECT_EQ(answer.readings[7].value, Value{7.0});

  const std::string eight = ">+00.500+01.000+02.000+03.000+04.000+05.000+06.000+07.000";
  const Answer first = script.Run(Poll(0), {{"#01", eight}});
  EXPECT_TRUE(IsBad(first.readings[0].quality));
  EXPECT_EQ(first.readings[1].value, Value{1.0});
  const Answer mended = script.Run(Poll(0), {{"$016", "!01FF"}, {"#01", eight}});
  ASSERT_EQ(mended.readings.size(), 8U);
  EXPECT_EQ(mended.readings[0].value, Value{0.5});
}

/// The module's checksum is off, but configured: `@01A1`, a read with a checksum, would set its
/// outputs.
TEST(DconIdentification, InAnUnknownModeNoPossibleWriteIsSent) {
  const config::Point bit = ReadPoint("bit", "@[b0]", Type::boolean);
  Script script(MakeDevice({bit}, {{"identify", true}, {"checksum", true}}));
  const Answer silent =
      script.Run(Poll(0), {{"$01MD2", ""}, {"$012B7", ""}, {"$01M", ""}, {"$012", ""}});
  EXPECT_EQ(silent.then, Then::done);
  script.Run(Probe(), {{"$01MD2", ""}});
  script.Run(Probe(), {{"$01MD2", ""}});
  script.Run(Probe(), {{"$01MD2", ""}});
  const Answer found = script.Run(Probe(), {{"$01M", "!017050"}});
  EXPECT_EQ(found.then, Then::replan);
  EXPECT_NE(script.trouble().text.find(
                "the module's checksum is off, but the configuration has checksum: true"),
            std::string::npos)
      << script.trouble().text;
  script.Run(Poll(0), {{"$01MD2", ""}, {"$012B7", ""}, {"$01M", "!017050"}});
  const Answer mended = script.Run(Poll(0), {{"$01MD2", "!0170504E"}});
  EXPECT_FALSE(script.trouble());
  EXPECT_EQ(mended.then, Then::replan);
  script.Run(Poll(0), {{"$012B7", ""}, {"@01A1", ">0001FF"}});
}

TEST(DconIdentification, AReplyWithAChecksumDoesNotProveAnUncheckedMode) {
  Script script(TwoInputs({{"checksum", true}}));
  const Bytes request = ToBytes("$01M\r");
  EXPECT_EQ(script.talk()->Check(request, ToBytes("!017017\r")), Outcome::ok);
  EXPECT_EQ(script.talk()->Check(request, ToBytes("!01701751\r")), Outcome::unexpected);
}

TEST(DconIdentification, AModuleWithoutNameIsReadAfterOneSilentRound) {
  Script script(TwoInputs());
  script.Run(
      Poll(0),
      {{"$01M", ""}, {"$012", ""}, {"$01MD2", ""}, {"$012B7", ""}, {"#01", ">+05.000+06.000"}});
  EXPECT_FALSE(script.trouble());
  script.Run(Poll(0), {{"$016", "?01"}, {"#01", ">+05.000+06.000"}});
  script.Run(Poll(0), {{"#01", ">+05.000+06.000"}});
}

TEST(DconIdentification, ARefusalIsNoContradiction) {
  const config::Point bit = ReadPoint("bit", "@[b0]", Type::boolean);
  Script script(MakeDevice({bit}, {{"identify", true}}));
  script.Run(Poll(0), {{"$01M", "?01"}, {"$012", "?01"}, {"@01", ">0001"}});
  EXPECT_FALSE(script.trouble());
}

TEST(DconIdentification, AWriteWaitsForTheIdentification) {
  const config::Point relay = WritePoint("relay", "$6[b8]", "#10{bit}", Type::boolean);
  Script script(
      MakeDevice({relay}, {{"identify", true}, {"types", std::vector<std::string>{"40"}}}));
  script.Run(Write(0, true), {{"$01M", "!017060"}, {"$012", "!01500600"}});
  EXPECT_TRUE(script.trouble());
  script.Run(Write(0, true), {{"$01M", "!017060"}, {"$012", "!01400600"}});
  EXPECT_FALSE(script.trouble());
  EXPECT_EQ(Asked(script.talk(), Write(0, true)), "#011001\r");
}

/// The module was not identified, so it may use a checksum. Then it would take "70" in `#01+03.070`
/// for the checksum and write 3.0.
TEST(DconIdentification, AnAmbiguousWriteNeedsAModuleOfKnownChecksumMode) {
  const config::Point volts = WritePoint("volts", "", "#{+00.000 0..10}");
  const config::Device device = MakeDevice({volts}, {{"identify", true}});
  Script silent(device);
  silent.Run(Write(0, 3.071),
             {{"$01M", ""}, {"$012", ""}, {"$01MD2", ""}, {"$012B7", ""}, {"#01+03.071", ">"}});
  const auto refused = silent.talk().Ask(Write(0, 3.07));
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().find("could take the end of this command for a checksum"),
            std::string::npos);
  silent.Run(Write(0, 3.071), {{"#01+03.071", ">"}});

  Script telling(device);
  telling.Run(Write(0, 3.07), {{"$01M", "!017024"}, {"$012", "!01320600"}, {"#01+03.070", ">"}});
}

TEST(DconIdentification, AConfigurationReadByAPollIsCompared) {
  config::Device device = TwoInputs();
  device.points.push_back(ReadPoint("configuration", "$2", Type::string, Group::slow));
  device.points.back().text_length = 6;
  Script script(device);
  script.Run(
      Poll(0),
      {{"$01M", "!017017"}, {"$012", "!01080600"}, {"$016", "!0103"}, {"#01", ">+05.000+06.000"}});
  const Answer answer = script.Run(Poll(1), {{"$012", "!01080601"}});
  EXPECT_EQ(answer.then, Then::replan);
  EXPECT_TRUE(script.trouble());
}

std::string Say(Twin& twin, const config::Device& device, std::string_view request) {
  const Bytes reply = AskTwin(DconProtocol(), twin, device.options, ToBytes(request));
  return std::string(AsText(reply));
}

TEST(DconTwinTest, RepliesLikeTheWorkedExample) {
  const config::Device device = EightInputs();
  FixedValues values;
  values.values = {{0, 100.23},  {1, 34.050}, {2, 124.56},  {3, 7.331},
                   {4, -101.45}, {5, 1038.9}, {6, -50.501}, {7, 5.880}};
  DconTwin twin(device, values);
  EXPECT_EQ(Say(twin, device, "#0184\r"),
            ">+100.23+34.050+124.56+07.331-101.45+1038.9-50.501+05.880FC\r");
  EXPECT_EQ(Say(twin, device, "#017BB\r"), AsText(BuildReply(">+05.880", true)));
}

TEST(DconTwinTest, IsSilentLikeTheModule) {
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

TEST(DconTwinTest, ReturnsItsNameAndRefusesIfConfigured) {
  const config::Device device = MakeDevice({ReadPoint("a", "#[0]")}, {{"identify", true}});
  FixedValues values;
  DconTwin twin(device, values);
  EXPECT_EQ(Say(twin, device, "$01M\r"), "!01TWIN\r");
  EXPECT_EQ(Say(twin, device, "$012\r"), "!01400600\r");
  EXPECT_EQ(Say(twin, device, "#019\r"), "?01\r");
  EXPECT_EQ(Say(twin, device, "$01Z\r"), "");
}

TEST(DconTwinTest, RepliesUnderAnotherAddressInAddressedReplies) {
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

TEST(DconTwinTest, SendsACounterWithItsChecksumInFront) {
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

TEST(DconTwinTest, SendsDisabledChannelsInEveryManner) {
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

TEST(DconTwinTest, SendsCodesForFaultsAndTooLargeValues) {
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
