// Tests the simulated device on the wire: its answers and its silence.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/twin.h"

#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

class SpaTwinTest : public ::testing::Test {
 protected:
  SpaTwinTest() {
    device_ = MakeDevice({MakePoint("I1"), MakePoint("I2"), MakePoint("I3"),
                          MakePoint("O1", Type::boolean), MakePoint("F", Type::string, Group::once),
                          MakePoint("V150", Type::uint16, Group::slow, Access::read_write),
                          MakePoint("V101", Type::uint16, Group::slow, Access::write)});
    values_.Set(0, 0.5);
    values_.Set(1, 0.25);
    values_.Set(2, 0.125);
    values_.Set(3, true);
    values_.Set(4, std::string("SPCJ 4D29"));
    values_.Set(5, std::int64_t{0});
  }

  std::string Say(const std::string& request) {
    if (!twin_) twin_ = SpabusProtocol().make_twin(device_, values_);
    const Bytes reply = twin_->Answer(ToBytes(request + "\r"), {});
    return std::string(AsText(reply));
  }
  std::string Heard(const std::string& request) {
    const std::string reply = Say(request);
    return reply.empty() ? "" : reply.substr(1, reply.rfind(':'));
  }

  config::Device device_;
  FixedValues values_;
  std::unique_ptr<Twin> twin_;
};

TEST_F(SpaTwinTest, AnswersLikeTheReference) {
  EXPECT_EQ(Say(">1RF:21"), "\n<1D:SPCJ 4D29:18\r\n");
  EXPECT_EQ(Heard(">1RI1/3:XX"), "<1D:0.50/0.25/0.125:");
  EXPECT_EQ(Heard(">1RO1:XX"), "<1D:1:");
  EXPECT_EQ(Heard(">1R0I1:XX"), "<1D:0.50:") << "channel 0 may be written out";
  EXPECT_EQ(Heard(">1RC:XX"), "<1D:0:");
  EXPECT_EQ(Heard(">1RL:2B"), "<1D::");
  EXPECT_EQ(Heard(">1RB:25"), "<1D::");
}

TEST_F(SpaTwinTest, IsSilentLikeARelay) {
  EXPECT_EQ(Say(">2RF:XX"), "");
  EXPECT_EQ(Say(">900WT:12.345:1B"), "");
  EXPECT_EQ(Say("1RF:21"), "");
  EXPECT_EQ(Say(">RF:XX"), "");
}

TEST_F(SpaTwinTest, RepliesUnderAnotherNumberIfConfigured) {
  Say("");
  twin_->ReplyAs("17");
  EXPECT_EQ(Heard(">1RO1:XX"), "<17D:1:");
  EXPECT_EQ(Heard(">1RZ1:XX"), "<17N:5:");
  EXPECT_EQ(Heard(">17RO1:XX"), "") << "it is still called 1";
}

TEST_F(SpaTwinTest, RefusesWithTheCodesOfTheProtocol) {
  EXPECT_EQ(Heard(">1RF:22"), "<1N:0:");
  EXPECT_EQ(Heard(">1RZ1:XX"), "<1N:5:");
  EXPECT_EQ(Heard(">1RI1/4:XX"), "<1N:6:");
  EXPECT_EQ(Heard(">1RI9:XX"), "<1N:6:");
  EXPECT_EQ(Heard(">1RI1/999999:XX"), "<1N:3:");
  EXPECT_EQ(Heard(">1WI1:1:XX"), "<1N:7:");
  EXPECT_EQ(Heard(">1WV77:1:XX"), "<1N:6:");
  EXPECT_EQ(Heard(">1WV150:1.5:XX"), "<1N:8:");
  EXPECT_EQ(Heard(">1WV150:70000:XX"), "<1N:8:");
  EXPECT_EQ(Heard(">1WV150:on:XX"), "<1N:8:");
  EXPECT_EQ(Heard(">1WV150:1/2:XX"), "<1N:5:");
  EXPECT_EQ(Heard(">1WV150/151:1/2:XX"), "<1N:3:");
}

TEST_F(SpaTwinTest, AcceptsWrites) {
  EXPECT_EQ(Say(">1WV150:1:XX"), "\n<1A:76\r\n");
  EXPECT_EQ(Heard(">1RV150:XX"), "<1D:1:");
  EXPECT_EQ(Heard(">1WV101:1:XX"), "<1A:") << "write-only";
  EXPECT_EQ(values_.Get(6, {}), Value(std::int64_t{1}));
}

TEST_F(SpaTwinTest, RefusesMoreDecimalsThanItHas) {
  device_.points[0].access = Access::read_write;
  device_.points[0].read = "S1";
  device_.points[0].writing.decimals = 2;
  EXPECT_EQ(Heard(">1WS1:30.3:XX"), "<1A:");
  EXPECT_EQ(Heard(">1WS1:30.299999:XX"), "<1N:8:");
  EXPECT_EQ(Heard(">1RS1:XX"), "<1D:30.30:");
}

TEST_F(SpaTwinTest, GuardsWritesWithThePassword) {
  device_.options.Set("password", std::int64_t{345});
  EXPECT_EQ(Heard(">1WV150:1:XX"), "<1N:7:");
  EXPECT_EQ(Heard(">1WV160:344:XX"), "<1N:7:");
  EXPECT_EQ(Heard(">1WV161:345:XX"), "<1N:7:") << "not open";
  EXPECT_EQ(Heard(">1WV160:345:XX"), "<1A:");
  EXPECT_EQ(Heard(">1WV150:1:XX"), "<1A:");
  EXPECT_EQ(Heard(">1WV161:345:XX"), "<1A:");
  EXPECT_EQ(Heard(">1WV150:0:XX"), "<1N:7:") << "closed again";
}

TEST_F(SpaTwinTest, AnotherValueInTheClosingItemChangesThePassword) {
  device_.options.Set("password", std::int64_t{345});
  Say(">1WV160:345:XX");
  EXPECT_EQ(Heard(">1WV161:7:XX"), "<1A:");
  EXPECT_EQ(Heard(">1WV161:7:XX"), "<1A:");
  EXPECT_EQ(Heard(">1WV160:345:XX"), "<1N:7:");
  EXPECT_EQ(Heard(">1WV160:7:XX"), "<1A:");
}

config::Device Talkative(const std::string& reading, FixedValues& values) {
  std::vector<config::Point> points;
  for (int i = 1; i <= 20; ++i) {
    points.push_back(MakePoint("M" + std::to_string(i), Type::string));
    values.Set(static_cast<std::size_t>(i - 1), std::string(30, static_cast<char>('a' + i)));
  }
  config::Device device = MakeDevice(std::move(points), "12");
  device.options.Set("max_items", std::int64_t{32});
  device.options.Set("continuation_checksum", reading);
  return device;
}

TEST(SpaRoundTrip, ContinuedRepliesAreReadWithEveryChecksumReading) {
  for (const char* reading : {"auto", "a", "b", "c", "d"}) {
    for (const bool line_feed : {false, true}) {
      FixedValues values;
      config::Device device = Talkative(reading, values);
      device.options.Set("lf_in_checksum", line_feed);
      Talk talk(SpabusProtocol(), device);
      const auto twin = SpabusProtocol().make_twin(device, values);
      ASSERT_EQ(talk->Queries().size(), 1U);
      const Answer answer = talk.Exchange(Poll(0), *twin);
      EXPECT_EQ(answer.outcome, Outcome::ok) << reading;
      ASSERT_EQ(answer.readings.size(), 20U) << reading;
      EXPECT_EQ(answer.readings[9].value, Value(std::string(30, 'k')));
    }
  }
}

TEST(SpaRoundTrip, GuardedWriteEndsWithThePasswordClosed) {
  config::Device device =
      MakeDevice({MakePoint("V150", Type::uint16, Group::slow, Access::read_write)});
  device.options.Set("password", std::int64_t{12});
  FixedValues values;
  const auto twin = SpabusProtocol().make_twin(device, values);
  Talk talk(SpabusProtocol(), device);
  const Task write = Write(0, Value(std::int64_t{1}));
  EXPECT_EQ(talk.Run(write, *twin).outcome, Outcome::ok);
  EXPECT_EQ(values.Get(0, {}), Value(std::int64_t{1}));
  EXPECT_EQ(AsText(twin->Answer(ToBytes(">1WV150:0:XX\r"), {})).substr(0, 7), "\n<1N:7:");
}

TEST(SpaRoundTrip, AWrongPasswordIsTriedOnce) {
  config::Device relay =
      MakeDevice({MakePoint("V150", Type::uint16, Group::slow, Access::read_write)});
  config::Device mistaken = relay;
  relay.options.Set("password", std::int64_t{12});
  mistaken.options.Set("password", std::int64_t{13});
  FixedValues values;
  const auto twin = SpabusProtocol().make_twin(relay, values);
  Talk talk(SpabusProtocol(), mistaken);
  const Task write = Write(0, Value(std::int64_t{1}));
  EXPECT_EQ(talk.Run(write, *twin).outcome, Outcome::refused);
  EXPECT_TRUE(Asked(talk, write).starts_with("error"));
  EXPECT_FALSE(HasValue(values.Get(0, {})));
}

TEST(SpaRoundTrip, MissingItemsAreFoundWithoutLosingTheOthers) {
  std::vector<config::Point> wanted;
  std::vector<config::Point> present;
  FixedValues values;
  for (int i = 1; i <= 13; ++i) {
    wanted.push_back(MakePoint("O" + std::to_string(i), Type::boolean));
    if (i == 3 || i == 9) continue;
    values.Set(present.size(), true);
    present.push_back(wanted.back());
  }
  const config::Device relay = MakeDevice(std::move(present));
  const auto twin = SpabusProtocol().make_twin(relay, values);
  Talk talk(SpabusProtocol(), MakeDevice(std::move(wanted)));
  std::map<std::size_t, Quality> seen;
  std::size_t exchanges = 0;
  for (int round = 0; round < 3; ++round) {
    for (std::size_t query = 0; query < talk->Queries().size();) {
      ASSERT_LT(++exchanges, 90U) << "the plan does not settle";
      const Answer answer = talk.Exchange(Poll(query), *twin);
      for (const Reading& reading : answer.readings) seen[reading.point] = reading.quality;
      query = answer.then == Then::replan ? 0 : query + 1;
    }
  }
  ASSERT_EQ(seen.size(), 13U);
  for (const auto& [point, quality] : seen) {
    const bool lacking = point == 2 || point == 8;
    EXPECT_EQ(quality, lacking ? Quality::bad_configuration : Quality::good) << point;
  }
}

}  // namespace
}  // namespace baudgate::protocols::spabus
