// Tests of `PointWatch`: the events that readings of a point cause by its rules.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/point_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "gateway/records/events/event_queue.h"
#include "gateway/records/events/own_records.h"

namespace baudgate::events {
namespace {

using config::AlarmPriority;
using config::PointEvent;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using On = config::PointEvent::On;

struct Seen {
  Value value;
  Quality quality = Quality::good;
};
Seen Bad(Value value) { return {std::move(value), Quality::bad_sensor_failure}; }
Seen Num(double value) { return {Value(value)}; }
Seen Bit(bool value) { return {Value(value)}; }
Seen Word(const std::string& value) { return {Value(value)}; }

/// Returns the events that one reading per second causes. Example: "2 on" is the event of reading
/// 2, counted from 0; "!" marks the first known state.
std::vector<std::string> Play(const PointEvent& rule, const std::vector<Seen>& readings) {
  PointWatch watch(rule);
  std::vector<std::string> found;
  Instant now;
  for (std::size_t i = 0; i < readings.size(); ++i, now += 1s) {
    const auto finding = watch.Take(readings[i].value, readings[i].quality, now);
    if (!finding) continue;
    found.push_back(std::to_string(i) + " " + std::string(Name(finding->state)) +
                    (finding->first ? "!" : ""));
  }
  return found;
}
PointEvent Rule(On on, double value = 0, double hysteresis = 0, Duration delay = {}) {
  PointEvent rule;
  rule.on = on;
  rule.value = value;
  rule.hysteresis = hysteresis;
  rule.delay = delay;
  return rule;
}
PointEvent Alarming(PointEvent rule) {
  rule.alarm = AlarmPriority::high;
  return rule;
}

PointEvent Normal(const std::string& normal) {
  PointEvent rule = Rule(On::change);
  rule.normal = normal;
  return rule;
}

TEST(PointWatch, AFaultCodeRaisesAnEvent) {
  const Seen none{Value(std::int64_t{0})};
  const Seen oc1{Value(std::int64_t{16})};
  const Seen oc2{Value(std::int64_t{17})};
  EXPECT_THAT(Play(Normal("0"), {none, oc1, oc1, oc2, Bad(Value()), oc2, none, none}),
              ElementsAre("1 on", "3 on", "6 off"));
  EXPECT_THAT(Play(Normal("0"), {oc1, none}), ElementsAre("0 on", "1 off"));
  EXPECT_THAT(Play(Normal("0"), {none, none}), IsEmpty());
  EXPECT_THAT(Play(Alarming(Normal("0")), {none}), ElementsAre("0 off!"));
  EXPECT_THAT(Play(Alarming(Normal("0")), {oc1}), ElementsAre("0 on!"));
  EXPECT_THAT(Play(Normal("0"), {Num(0), Num(0.5), Num(0)}), ElementsAre("1 on", "2 off"));
  EXPECT_THAT(Play(Normal("no fault"), {Word("no fault"), Word("E.OC1"), Word("no fault")}),
              ElementsAre("1 on", "2 off"));
}

TEST(PointWatch, AnExceededLimitRaisesAnEvent) {
  EXPECT_THAT(Play(Rule(On::above, 5), {Num(4), Num(5), Num(5.1), Num(6), Num(5), Num(6)}),
              ElementsAre("2 on", "4 off", "5 on"));
  EXPECT_THAT(Play(Rule(On::below, 5), {Num(6), Num(5), Num(4.9), Num(4), Num(5)}),
              ElementsAre("2 on", "4 off"));
  EXPECT_THAT(Play(Rule(On::above, 5, 1), {Num(4), Num(6), Num(4.5), Num(6), Num(4), Num(4.5)}),
              ElementsAre("1 on", "4 off"));
  EXPECT_THAT(Play(Rule(On::below, 5, 1), {Num(7), Num(4), Num(5.5), Num(6)}),
              ElementsAre("1 on", "3 off"));
  EXPECT_THAT(Play(Rule(On::below, 1), {Bit(true), Bit(false), Bit(true)}),
              ElementsAre("1 on", "2 off"));
}

/// In binary, 53 times 0.1 is a little less than 5.3.
TEST(PointWatch, LimitsAreComparedAsDecimals) {
  EXPECT_THAT(Play(Rule(On::above, 5.3), {Num(5), Num(53 * 0.1), Num(5.4)}), ElementsAre("2 on"));
  EXPECT_THAT(Play(Rule(On::below, -0.3), {Num(0), Num(-3 * 0.1), Num(-0.4)}), ElementsAre("2 on"));
  EXPECT_THAT(Play(Rule(On::below, 4.9, 0.2), {Num(6), Num(4.8), Num(5.1)}),
              ElementsAre("1 on", "2 off"));
  EXPECT_THAT(Play(Rule(On::change, 0, 0.1), {Num(0.7), Num(0.8), Num(0.9)}),
              ElementsAre("2 message"));
}

TEST(PointWatch, WaitsForItsDelay) {
  const PointEvent rule = Rule(On::above, 5, 2, 2s);
  EXPECT_THAT(Play(rule, {Num(1), Num(6), Num(6), Num(6), Num(6)}), ElementsAre("3 on"));
  EXPECT_THAT(Play(rule, {Num(1), Num(6), Num(6), Num(1), Num(6), Num(6), Num(6)}),
              ElementsAre("6 on"))
      << "it has to last";
  EXPECT_THAT(
      Play(rule, {Num(1), Num(6), Num(6), Num(6), Num(1), Num(1), Num(6), Num(1), Num(1), Num(1)}),
      ElementsAre("3 on", "9 off"))
      << "and so has its end";
  EXPECT_THAT(Play(Rule(On::change, 0, 0, 2s),
                   {Num(1), Num(1), Num(1), Num(2), Num(3), Num(3), Num(3), Num(3)}),
              ElementsAre("6 message"));
}

TEST(PointWatch, IgnoresBadReadings) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Play(Rule(On::above, 5), {Num(1), Bad(9.0), Num(nan), {}, Num(6), Bad(1.0), Num(6)}),
              ElementsAre("4 on"));
  EXPECT_THAT(Play(Rule(On::above, 5, 0, 2s), {Num(1), Num(6), Bad(6.0), Num(6)}),
              ElementsAre("3 on"))
      << "it ends no delay";
  EXPECT_THAT(Play(Rule(On::change), {Bit(true), Bad(false), Bit(true)}), IsEmpty());
  EXPECT_THAT(Play(Rule(On::above, 5), {Num(1), {Value(6.0), Quality::uncertain}}),
              ElementsAre("1 on"))
      << "uncertain is a value";
}

TEST(PointWatch, AChangeRaisesAnEvent) {
  EXPECT_THAT(Play(Rule(On::change), {Num(1), Num(1), Num(2), Num(1)}),
              ElementsAre("2 message", "3 message"));
  EXPECT_THAT(Play(Rule(On::change), {Bit(true), Bit(false), Bit(true)}),
              ElementsAre("1 off", "2 on"));
  EXPECT_THAT(Play(Rule(On::change), {Word("a"), Word("a"), Word("b")}), ElementsAre("2 message"));
  EXPECT_THAT(Play(Rule(On::change, 0, 1), {Num(1), Num(2), Num(2.5), Num(3), Num(4)}),
              ElementsAre("2 message", "4 message"))
      << "counted from what was told last";
  const std::uint64_t large = 1ULL << 60U;
  EXPECT_THAT(Play(Rule(On::change), {{Value(large)}, {Value(large + 1)}}),
              ElementsAre("1 message"));
}

TEST(PointWatch, TheFirstReadingRaisesAnEventBeyondTheLimit) {
  EXPECT_THAT(Play(Rule(On::above, 5), {Num(6)}), ElementsAre("0 on")) << "told once more";
  EXPECT_THAT(Play(Rule(On::above, 5), {Num(4)}), IsEmpty());
  EXPECT_THAT(Play(Alarming(Rule(On::above, 5)), {Num(6), Num(4)}), ElementsAre("0 on!", "1 off"));
  EXPECT_THAT(Play(Alarming(Rule(On::above, 5)), {Num(4), Num(6)}), ElementsAre("0 off!", "1 on"));
  EXPECT_THAT(Play(Alarming(Rule(On::above, 5, 1)), {Num(4.5), Num(4.2), Num(6)}),
              ElementsAre("2 on!"))
      << "nobody knows on which side it was";
  EXPECT_THAT(Play(Alarming(Rule(On::change)), {Bit(true), Bit(false)}),
              ElementsAre("0 on!", "1 off"));
  EXPECT_THAT(Play(Alarming(Rule(On::change)), {Num(1), Num(2)}), ElementsAre("1 message"));
}

class DeviceWatchTest : public ::testing::Test {
 protected:
  DeviceWatchTest() {
    device_.name = "relay";
    config::Point point;
    point.name = "other";
    device_.points.push_back(point);
    point.name = "current_l1";
    point.unit = "A";
    point.events = {Rule(On::above, 5), Alarming(Rule(On::above, 8))};
    point.events[1].text = "overcurrent";
    device_.points.push_back(point);
  }
  const std::string line_ = "bay";
  config::Device device_;
  const Now at_{Instant() + 1h, WallTime(1'790'000'000s)};
};

TEST_F(DeviceWatchTest, ItsRecordsHavePointValueAndUnit) {
  DeviceWatch watch(line_, std::make_shared<const config::Device>(device_));
  EXPECT_FALSE(watch.Watches(0));
  ASSERT_TRUE(watch.Watches(1));
  EXPECT_THAT(watch.Take(0, Value(9.0), Quality::good, at_), IsEmpty());
  const auto records = watch.Take(1, Value(8.25), Quality::good, at_);
  ASSERT_EQ(records.size(), 2U);
  EXPECT_EQ(records[0].text, "current_l1 8.25 A: above 5");
  EXPECT_EQ(records[0].line, "bay");
  EXPECT_EQ(records[0].device, "relay");
  EXPECT_EQ(records[0].channel, 0U);
  EXPECT_EQ(records[0].code, CodeOf(OwnCode::point_above));
  EXPECT_EQ(records[0].state, config::EventState::on);
  EXPECT_EQ(records[0].clock, ClockQuality::gateway);
  EXPECT_EQ(records[0].device_time, at_.wall);
  EXPECT_EQ(records[0].subject, "current_l1 above 5");
  EXPECT_EQ(records[0].mark.step, AlarmMark::Step::none);
  EXPECT_EQ(records[1].text, "current_l1 8.25 A: overcurrent");
  EXPECT_EQ(records[1].mark.step, AlarmMark::Step::raise);
  EXPECT_EQ(records[1].mark.priority, AlarmPriority::high);
  EXPECT_EQ(records[1].mark.point, "current_l1");
  EXPECT_TRUE(records[1].mark.first);
  const auto over = watch.Take(1, Value(7.0), Quality::good, at_);
  ASSERT_EQ(over.size(), 1U);
  EXPECT_EQ(over[0].text, "current_l1 7 A: overcurrent, over");
  EXPECT_EQ(over[0].mark.step, AlarmMark::Step::clear);
}

config::Config Configured() {
  config::PointEvent above;
  above.on = config::PointEvent::On::above;
  above.value = 5;
  above.alarm = config::AlarmPriority::high;
  config::PointEvent below = above;
  below.on = config::PointEvent::On::below;
  below.alarm = config::AlarmPriority::none;
  config::Point point;
  point.name = "current";
  point.events = {above, below};
  config::EventText trip;
  trip.code = 3;
  trip.alarm = config::AlarmPriority::high;
  config::EventText start;
  start.code = 1;
  config::Device device;
  device.name = "feeder-1";
  device.events = device.point_events = true;
  device.event_texts = {start, trip};
  device.points = {point};
  config::Device quiet = device;
  quiet.name = "feeder-2";
  quiet.events = quiet.point_events = false;
  config::Line line;
  line.name = "bay-1";
  line.devices = {device, quiet};
  line.devices[1].alarms.priority = config::AlarmPriority::none;
  config::Config config;
  config.lines = {line};
  config::Route route;
  route.first = route.last = 20;
  route.line = "bay-1";
  config.modbus.routes = {route};
  return config;
}

TEST(Watched, AlarmsAreThoseOfTheConfiguration) {
  const config::Config config = Configured();
  struct Row {
    const char* line;
    const char* device;
    const char* name;
    const char* point;
    bool watched;
  };
  const Row rows[] = {
      {"bay-1", "feeder-1", "current above 5", "current", true},
      {"bay-1", "feeder-1", "current above 6", "current", false},
      {"bay-1", "feeder-1", "current below 5", "current", false},
      {"bay-1", "feeder-1", "voltage above 5", "voltage", false},
      {"bay-1", "feeder-1", "0:3", "", true},
      {"bay-1", "feeder-1", "2:3", "", true},
      {"bay-1", "feeder-1", "0:1", "", false},
      {"bay-1", "feeder-1", "0:13", "", false},
      {"bay-1", "feeder-2", "current above 5", "current", false},
      {"bay-1", "feeder-2", "0:3", "", false},
      {"bay-1", "feeder-3", "0:3", "", false},
      {"bay-2", "feeder-1", "0:3", "", false},
      {"bay-1", "feeder-1", "no answer", "", true},
      {"bay-1", "feeder-2", "no answer", "", false},
      {"bay-1", "feeder-3", "no answer", "", false},
      {"bay-1", "", "port down", "", true},
      {"bay-2", "", "port down", "", false},
      {"bay-1", "unit-20", "no answer to clients", "", true},
      {"bay-1", "unit-21", "no answer to clients", "", false},
      {"", "", "events are not kept", "", true},
  };
  for (const Row& row : rows) {
    Alarm alarm;
    alarm.line = row.line;
    alarm.device = row.device;
    alarm.name = row.name;
    alarm.point = row.point;
    EXPECT_EQ(PriorityOf(config, alarm).has_value(), row.watched)
        << row.line << "." << row.device << " " << row.name;
  }
}

}  // namespace
}  // namespace baudgate::events
