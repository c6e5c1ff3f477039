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

TEST(PointEvents, SayWhatIsWrong) {
  const auto wrong = [](const std::string& events, const std::string& type = "float32") {
    return Shown(LoadPoint(events, type).problems);
  };
  EXPECT_THAT(wrong("{ on: above }"),
              HasSubstr("t.yaml:4:83: error: on: 'above' needs a limit: { on: above, value: 5 }"));
  EXPECT_THAT(wrong("{ value: 5 }"), HasSubstr("'on'"));
  EXPECT_THAT(wrong("{ on: rises }"), HasSubstr("'rises' is unknown"));
  EXPECT_THAT(wrong("{ on: change, value: 5 }"), HasSubstr("value: every change counts"));
  EXPECT_THAT(wrong("{ on: above, value: 5, hysteresis: -1 }"),
              HasSubstr("hysteresis: must not be negative"));
  EXPECT_THAT(wrong("{ on: change, hysteresis: 1 }", "bool"), HasSubstr("only numbers have one"));
  EXPECT_THAT(wrong("{ on: above, value: 5 }", "string(4)"), HasSubstr("a text is neither above"));
  EXPECT_THAT(wrong("{ on: above, value: 65535 }", "uint16"),
              HasSubstr("'a' is from 0 to 65535, and never above 65535"));
  EXPECT_THAT(wrong("{ on: below, value: 0 }", "bool"), HasSubstr("never below 0"));
  EXPECT_EQ(wrong("{ on: below, value: 1 }", "bool"), "");
  EXPECT_THAT(wrong("{ on: above, value: 5, hysteresis: 10 }", "uint16"),
              HasSubstr("hysteresis: 'a' is from 0 to 65535, and never back below -5"));
  EXPECT_THAT(wrong("{ on: below, value: 65535, hysteresis: 1 }", "uint16"),
              HasSubstr("never back above 65536"));
  EXPECT_EQ(wrong("{ on: above, value: 5, hysteresis: 5 }", "uint16"), "");
  EXPECT_THAT(wrong("{ on: change, hysteresis: 70000 }", "uint16"),
              HasSubstr("and never changes by more"));
  EXPECT_THAT(wrong("{ on: above, value: 5, colour: red }"), HasSubstr("colour"));
  EXPECT_THAT(wrong("{ on: change, alarm: urgent }"), HasSubstr("'urgent' is unknown"));
  EXPECT_THAT(wrong("[{ on: change }, { on: change, alarm: yes }]"),
              HasSubstr("'change' stands twice"));
  EXPECT_THAT(wrong("{ on: change }, write: B1, access: w", "bool"),
              HasSubstr("events: 'a' can only be written"));
}

std::string ProblemsOfTable(const std::string& events) {
  static const Protocol kProtocol = MakeFakeProtocol("fake");
  config::Problems problems;
  const std::string head = "device: D\npoints: [{ name: a, read: A1, type: uint16 }]\nevents:\n";
  config::ReadProfileText(head + events, "p.yaml", "p", kProtocol, problems);
  return Shown(problems.Sorted());
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

TEST(EventTable, SaysWhatIsWrongWithAlarms) {
  const std::string off = "- { code: 2, text: b, state: off }\n";
  EXPECT_EQ(ProblemsOfTable("- { code: 1, text: a, state: on, alarm: yes }\n"), "")
      << "it only waits to be acknowledged";
  EXPECT_THAT(ProblemsOfTable("- { code: 1, text: a, state: off, alarm: yes }\n"),
              HasSubstr("it stands at the event that begins it"));
  EXPECT_THAT(ProblemsOfTable("- { code: 1, text: a, state: on, alarm: yes, until: 2 }\n"),
              HasSubstr("p.yaml:4:53: error: until: the table has no code 2 with state: off"));
  EXPECT_THAT(ProblemsOfTable("- { code: 1, text: a, state: on, until: 2 }\n" + off),
              HasSubstr("only an alarm has an end"));
  EXPECT_THAT(ProblemsOfTable("- { code: 1, text: a, alarm: yes, until: 2 }\n" + off),
              HasSubstr("needs state: on"));
  EXPECT_THAT(ProblemsOfTable("- { code: 1, text: a, state: on, alarm: yes, until: 2 }\n"
                              "- { code: 3, text: a, state: on, alarm: yes, until: 2 }\n" +
                              off),
              HasSubstr("2 ends another alarm already"));
}

TEST(PointEvents, HaveANormalValue) {
  const auto loaded = LoadPoint("{ on: change, normal: 0, alarm: high }", "uint16");
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(DeviceOf(loaded).points.at(0).events.at(0).normal, "0");
  EXPECT_EQ(Shown(LoadPoint("{ on: change, normal: no fault }", "string(20)").problems), "");
  EXPECT_THAT(Shown(LoadPoint("{ on: change, normal: none }", "uint16").problems),
              HasSubstr("normal: 'a' is a number, and 'none' is none"));
  EXPECT_THAT(Shown(LoadPoint("{ on: change, normal: 0 }", "bool").problems),
              HasSubstr("normal: a bool is on and off by itself"));
  EXPECT_THAT(Shown(LoadPoint("{ on: above, value: 1, normal: 0 }").problems),
              HasSubstr("normal: only on: change has one"));
}

}  // namespace
}  // namespace baudgate::testing
