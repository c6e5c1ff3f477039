// The key events: of points, and alarms in a profile's table of events.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "config/loader.h"
#include "config/profile.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::AlarmPriority;
using config::PointEvent;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

config::Loaded LoadPoint(const std::string& events, const std::string& type = "float32",
                         const std::string& top = "events: {}\n", const std::string& device = "") {
  return Load(top +
              "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [\n"
              "{ name: d, address: 1" +
              device + ", points: [{ name: a, read: A1, type: " + type + ", events: " + events +
              " }] }] }\n");
}
const config::Device& DeviceOf(const config::Loaded& loaded) {
  return loaded.config.lines.at(0).devices.at(0);
}

TEST(PointEvents, AreRead) {
  const auto one = LoadPoint(
      "{ on: above, value: 5, hysteresis: 0.5, delay: 3s, text: \"too "
      "much\", alarm: high }");
  ASSERT_EQ(Shown(one.problems), "");
  const auto& events = DeviceOf(one).points.at(0).events;
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].on, PointEvent::On::above);
  EXPECT_EQ(events[0].value, 5);
  EXPECT_EQ(events[0].hysteresis, 0.5);
  EXPECT_EQ(events[0].delay, 3s);
  EXPECT_EQ(events[0].text, "too much");
  EXPECT_EQ(events[0].alarm, AlarmPriority::high);

  const auto two = LoadPoint("[{ on: change }, { on: below, value: 1, alarm: yes }]");
  ASSERT_EQ(Shown(two.problems), "");
  std::vector<std::string> conditions;
  for (const auto& event : DeviceOf(two).points.at(0).events) {
    conditions.push_back(ConditionOf(event));
  }
  EXPECT_THAT(conditions, ElementsAre("change", "below 1"));
  EXPECT_EQ(DeviceOf(two).points.at(0).events[1].alarm, AlarmPriority::medium);
}

TEST(PointEvents, AreKeptWhereTheGatewayKeepsEvents) {
  EXPECT_TRUE(DeviceOf(LoadPoint("{ on: change }")).point_events);
  EXPECT_FALSE(DeviceOf(LoadPoint("{ on: change }")).events) << "it is not asked for its own";
  EXPECT_TRUE(DeviceOf(LoadPoint("{ on: change }", "bool", "", ", events: on")).point_events);
  EXPECT_FALSE(
      DeviceOf(LoadPoint("{ on: change }", "bool", "events: {}\n", ", events: off")).point_events);
  const auto none = LoadPoint("{ on: change }", "bool", "");
  EXPECT_FALSE(DeviceOf(none).point_events);
  EXPECT_THAT(Shown(none.problems),
              HasSubstr("warning: events of 'a' are not kept: write 'events: {}'"));
}

TEST(EventTable, HasAlarms) {
  static const Protocol kProtocol = MakeFakeProtocol("fake");
  config::Problems problems;
  const auto raw = config::ReadProfileText(
      "device: D\npoints: [{ name: a, read: A1, type: uint16 }]\nevents:\n"
      "- { code: 1, text: started, state: on, alarm: high, until: 2 }\n"
      "- { code: 2, text: reset, state: off }\n- { code: 3, text: failed, alarm: yes }\n",
      "p.yaml", "p", kProtocol, problems);
  ASSERT_EQ(Shown(problems.Sorted()), "");
  const auto& table = raw.profile.event_texts;
  EXPECT_EQ(table[0].alarm, AlarmPriority::high);
  EXPECT_EQ(table[2].alarm, AlarmPriority::medium);
  ASSERT_NE(config::FindEndedAlarm(table, 7, 2), nullptr);
  EXPECT_EQ(config::FindEndedAlarm(table, 7, 2)->code, 1U);
  EXPECT_EQ(config::FindEndedAlarm(table, 7, 3), nullptr);
}

TEST(PointEvents, HaveANormalValue) {
  const auto loaded = LoadPoint("{ on: change, normal: 0, alarm: high }", "uint16");
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(DeviceOf(loaded).points.at(0).events.at(0).normal, "0");
}

}  // namespace
}  // namespace baudgate::testing
