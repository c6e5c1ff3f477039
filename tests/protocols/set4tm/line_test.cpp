// Tests a SET-4TM meter on a line: trials, learned properties, daily readings, cost.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <array>

#include "tests/protocols/set4tm/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::set4tm {
namespace {

using config::Group;
using config::Type;
using ::testing::HasSubstr;

enum PointIndex : std::uint32_t { kPower, kCurrent, kClock, kMonth, kAlarm };

config::Device Meter(const Settable& options = {{"snapshot", std::string("auto")}}) {
  config::Device device =
      MakeDevice("5",
                 {MakePoint("08 1B 00 00 float_le@0"), MakePoint("08 1B 00 21 float_le@0"),
                  MakePoint("04 00 time@0", Group::slow, Type::string),
                  MakePoint("0A 83 01 00 0F 00 energy@0", Group::daily),
                  MakePoint("08 0A alarm@0", Group::slow, Type::boolean)},
                 options);
  device.name = "meter";
  return device;
}

VirtualLine LineOf(config::Device device) {
  config::Line line = ToyLine({std::move(device)});
  line.protocol = "set4tm";
  line.options = line.devices[0].options;
  line.serial = Set4tmProtocol().serial;
  return {line, {&Set4tmProtocol()}};
}

void Measure(VirtualLine& line, std::string clock = "2026-11-21T12:00:00") {
  FixedValues& values = line.twin(0).values;
  values.Set(kPower, 800.0);
  values.Set(kCurrent, 5.0);
  values.Set(kClock, std::move(clock));
  values.Set(kMonth, 1.0001);
  values.Set(kAlarm, false);
}

std::size_t Count(const VirtualLine& line, std::string_view pdu) {
  std::size_t count = 0;
  for (const Sent& sent : line.sent) {
    count += ToHex(ToBytes(sent.text)).starts_with("05 " + std::string(pdu)) ? 1U : 0U;
  }
  return count;
}

TEST(Set4tmLine, FloatsAreReadTogetherAutomatically) {
  VirtualLine line = LineOf(Meter());
  Measure(line);
  line.Open();
  line.RunFor(1min);
  EXPECT_EQ(line.QualityOf(0, kPower), Quality::good);
  EXPECT_EQ(line.ValueOf(0, kCurrent), Value(5.0));
  EXPECT_EQ(Count(line, "08 1B"), 0U);
  EXPECT_GE(Count(line, "08 23"), 58U);
  EXPECT_EQ(line.StatusOf(0).learned, "floats are read together (08 23)");
}

TEST(Set4tmLine, SilenceToATrialCostsOneExchangeOnly) {
  VirtualLine line = LineOf(Meter());
  Measure(line);
  line.twin(0).manner.instead = [](View request) {
    return ToHex(request).starts_with("05 08 23") ? std::optional(Bytes()) : std::nullopt;
  };
  line.Open();
  line.RunFor(1min);
  EXPECT_EQ(Count(line, "08 23"), 1U);
  EXPECT_EQ(line.QualityOf(0, kPower), Quality::good);
  EXPECT_EQ(line.QualityOf(0, kCurrent), Quality::good);
  EXPECT_EQ(line.StatusOf(0).state, bus::DeviceState::online);
}

TEST(Set4tmLine, ALateReplyToATrialIsDropped) {
  VirtualLine line = LineOf(Meter());
  Measure(line);
  line.twin(0).manner.deliver = [](View request, Bytes reply, Instant) {
    const bool trial = ToHex(request).starts_with("05 08 23");
    return std::vector<tools::TimedPiece>{{trial ? 350ms : 30ms, std::move(reply)}};
  };
  line.always = [&] {
    if (line.QualityOf(0, kPower) == Quality::good) {
      EXPECT_EQ(line.ValueOf(0, kPower), Value(800.0));
    }
    if (line.QualityOf(0, kCurrent) == Quality::good) {
      EXPECT_EQ(line.ValueOf(0, kCurrent), Value(5.0));
    }
  };
  line.Open();
  line.RunFor(2min);
  EXPECT_EQ(line.QualityOf(0, kPower), Quality::good);
  EXPECT_EQ(line.QualityOf(0, kCurrent), Quality::good);
}

TEST(Set4tmLine, AMeterOfAnotherTypeHasNoGoodValue) {
  config::Device device = Meter({{"types", std::vector<std::string>{"8"}}});
  VirtualLine line = LineOf(device);
  Measure(line);
  bool other = true;
  line.twin(0).manner.instead = [&other](View request) -> std::optional<Bytes> {
    if (!other || !ToHex(request).starts_with("05 08 12")) return std::nullopt;
    return MakeFrame(Hex("05"), Hex("10 40 10"));
  };
  line.always = [&] {
    for (std::uint32_t point = 0; other && point <= kAlarm; ++point) {
      EXPECT_FALSE(IsGood(line.QualityOf(0, point))) << point;
    }
  };
  line.Open();
  line.RunFor(5min);
  EXPECT_EQ(line.QualityOf(0, kPower), Quality(Quality::bad_configuration, Reason::other_module));
  EXPECT_LE(line.sent.size(), 30U) << "its type and its channel, once a minute";
  other = false;
  line.RunFor(2min);
  EXPECT_EQ(line.QualityOf(0, kPower), Quality::good);
  EXPECT_EQ(line.QualityOf(0, kAlarm), Quality::good);
}

TEST(Set4tmLine, TheDailyRoundFollowsTheDayOfTheMeter) {
  VirtualLine line = LineOf(Meter());
  Measure(line);
  line.Open();
  line.RunFor(10s);
  const std::size_t at_start = Count(line, "0A 83");
  line.RunFor(1h);
  EXPECT_EQ(Count(line, "0A 83"), at_start);
  Measure(line, "2026-11-22T00:00:10");
  line.twin(0).values.Set(kMonth, 2.0);
  line.RunFor(2min);
  EXPECT_EQ(Count(line, "0A 83"), at_start + 1);
  EXPECT_EQ(line.ValueOf(0, kMonth), Value(2.0));
  line.RunFor(1h);
  EXPECT_EQ(Count(line, "0A 83"), at_start + 1);
}

TEST(Set4tmLine, IdentificationCostsNothingInTheSteadyState) {
  std::array<std::size_t, 2> sent{};
  for (const bool identified : {false, true}) {
    Settable options = {{"snapshot", std::string("false")}};
    if (identified) options.push_back({"types", std::vector<std::string>{"8"}});
    VirtualLine line = LineOf(Meter(options));
    Measure(line);
    line.Open();
    line.RunFor(1min);
    line.sent.clear();
    line.RunFor(10min);
    sent[identified ? 1 : 0] = line.sent.size();
  }
  EXPECT_EQ(sent[0], sent[1]);
}

TEST(Set4tmLine, AMeterWithAMultiplierGetsLongerTimes) {
  config::Device device = MakeDevice("5", {MakePoint("08 1B 00 00 float_le@0"),
                                           MakePoint("08 17 u8@1", Group::once, Type::uint16)});
  device.name = "meter";
  VirtualLine line = LineOf(device);
  line.twin(0).values.Set(0, 800.0);
  line.twin(0).values.Set(1, std::uint64_t{5});
  line.Open();
  line.RunFor(10s);
  EXPECT_THAT(line.StatusOf(0).learned, HasSubstr("multiplier 5"));
  // The think time exceeds the reply time of 300 ms, but the learned multiplier 5 lengthens the
  // wait to five times the meter's silence plus 500 ms.
  line.twin(0).manner.think = 550ms;
  line.sent.clear();
  line.RunFor(20s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  EXPECT_EQ(line.StatusOf(0).retries, 0U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
