// Tests the key events of the gateway, of devices and of profiles.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <string>

#include "config/history.h"
#include "config/loader.h"
#include "config/profile.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;

config::Loaded LoadWith(const std::string& top, const std::string& keys = "") {
  return Load(top +
              "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [\n"
              "{ name: d, address: 1" +
              keys + ", points: [{ name: a, read: A1, type: uint16 }] }] }\n");
}
bool Asked(const config::Loaded& loaded) { return loaded.config.lines.at(0).devices.at(0).events; }

TEST(EventsKey, EventsOfADeviceAreOffByDefault) {
  EXPECT_FALSE(Asked(LoadWith("")));
  EXPECT_FALSE(Asked(LoadWith("events: {}\n"))) << "nobody knows what its events mean";
  EXPECT_TRUE(Asked(LoadWith("", ", events: on")));
  EXPECT_FALSE(Asked(LoadWith("events: {}\n", ", events: off")));
  EXPECT_FALSE(LoadWith("").config.events.given);
  EXPECT_TRUE(LoadWith("events: {}\n").config.events.given);
  EXPECT_EQ(LoadWith("events: { directory: /data }\n").config.events.directory, "/data");
}

struct Table {
  std::vector<config::EventText> texts;
  std::vector<config::Problem> problems;
};
Table LoadTable(const std::string& events) {
  static const protocols::Protocol kProtocol = MakeFakeProtocol("fake");
  config::Problems problems;
  const std::string head = "device: D\npoints: [{ name: a, read: A1, type: uint16 }]\nevents:\n";
  const auto raw = config::ReadProfileText(head + events, "p.yaml", "p", kProtocol, problems);
  return {raw.profile.event_texts, problems.Sorted()};
}

TEST(EventTable, IsReadWithTextsAndStates) {
  const auto loaded = LoadTable(
      "- { code: 1, text: started, state: on }\n- { code: 1, channel: 2, text: \"2\" }\n"
      "- { code: 2, text: reset, state: off }\n");
  ASSERT_EQ(Shown(loaded.problems), "");
  const auto& table = loaded.texts;
  ASSERT_EQ(table.size(), 3U);
  EXPECT_EQ(config::FindEvent(table, 0, 1)->text, "started");
  EXPECT_EQ(config::FindEvent(table, 0, 1)->state, config::EventState::on);
  EXPECT_EQ(config::FindEvent(table, 2, 1)->text, "2") << "of its channel";
  EXPECT_EQ(config::FindEvent(table, 2, 1)->state, config::EventState::message);
  EXPECT_EQ(config::FindEvent(table, 3, 2)->state, config::EventState::off);
  EXPECT_EQ(config::FindEvent(table, 0, 3), nullptr);
}

using config::AlarmPriority;
using config::PointEvent;
using ::testing::ElementsAre;

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

TEST(PointEvents, AreReadWithAllTheirKeys) {
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

TEST(PointEvents, AreStoredOnlyIfTheGatewayStoresEvents) {
  EXPECT_TRUE(DeviceOf(LoadPoint("{ on: change }")).point_events);
  EXPECT_FALSE(DeviceOf(LoadPoint("{ on: change }")).events) << "it is not asked for its own";
  EXPECT_TRUE(DeviceOf(LoadPoint("{ on: change }", "bool", "", ", events: on")).point_events);
  EXPECT_FALSE(
      DeviceOf(LoadPoint("{ on: change }", "bool", "events: {}\n", ", events: off")).point_events);
  const auto none = LoadPoint("{ on: change }", "bool", "");
  EXPECT_FALSE(DeviceOf(none).point_events);
  EXPECT_THAT(Shown(none.problems),
              HasSubstr("warning: events of 'a' are not stored; write 'events: {}'"));
}

TEST(EventTable, AlarmsAreReadWithTheirEndEvents) {
  static const protocols::Protocol kProtocol = MakeFakeProtocol("fake");
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

std::string TextOf(const config::AlarmSetting& alarms) {
  return (alarms.on() ? std::string(Name(alarms.priority)) : "off") + " " +
         FormatDuration(alarms.delay);
}

TEST(AlarmsKey, EachKeyIsTakenFromTheMostSpecificSetting) {
  struct Row {
    const char* gateway;
    const char* line;
    const char* device;
    const char* route;
    const char* are;
  };
  const Row rows[] = {
      {"", "", "", "", "medium 30s, medium 30s, medium 30s, medium 30s"},
      {"alarms: high", "", "", "", "high 30s, high 30s, high 30s, high 30s"},
      {"alarms: { delay: 5s }", "alarms: low", "", "", "medium 5s, low 5s, low 5s, low 5s"},
      {"", "alarms: off", "alarms: { priority: high, delay: 0s }", "alarms: { delay: 1min }",
       "medium 30s, off 30s, high 0s, off 1min"},
      {"alarms: off", "", "alarms: medium", "alarms: low", "off 30s, off 30s, medium 30s, low 30s"},
  };
  for (const Row& row : rows) {
    const auto also = [](const char* key) { return *key == '\0' ? "" : std::string(", ") + key; };
    const config::Loaded loaded = config::LoadText(
        std::string("gateway: { name: g") + also(row.gateway) +
            " }\nlines: [{ name: l, port: /dev/l, protocol: modbus_rtu" + also(row.line) +
            ", devices: [{ name: d, address: 1, profile: generic-meter" + also(row.device) +
            " }] }]\nmodbus: { routes: [{ units: 20, line: l" + also(row.route) + " }] }\n",
        "t.yaml", Shipped());
    ASSERT_EQ(Shown(loaded.problems), "") << row.are;
    const config::Config& config = loaded.config;
    EXPECT_EQ(TextOf(config.alarms) + ", " + TextOf(config.lines[0].alarms) + ", " +
                  TextOf(config.lines[0].devices[0].alarms) + ", " +
                  TextOf(config.modbus.routes[0].alarms),
              row.are);
  }
}

TEST(EventAlarms, OverrideAlarmsOfTheEventTable) {
  const config::Loaded loaded = config::LoadText(
      "events: {}\nlines: [{ name: l, port: /dev/l, protocol: spabus, devices: [{ name: d, "
      "address: 1, profile: spaj140c, event_alarms: { \"2E17\": high, E3: off, 1E1: low, E1: "
      "medium } }] }]\n",
      "t.yaml", Shipped());
  ASSERT_EQ(Shown(loaded.problems), "");
  const auto& table = loaded.config.lines[0].devices[0].event_texts;
  struct Row {
    std::uint32_t channel;
    std::uint32_t code;
    const char* alarm;
  };
  const Row rows[] = {{2, 17, "high"},  {1, 17, ""},   {0, 3, ""},
                      {0, 1, "medium"}, {1, 1, "low"}, {0, 7, "high"}};
  for (const Row& row : rows) {
    EXPECT_EQ(Name(config::FindEvent(table, row.channel, row.code)->alarm), row.alarm)
        << row.channel << "E" << row.code;
  }
  EXPECT_EQ(config::FindEvent(table, 2, 17)->text, "output TS1 activated");
}

/// The expected alarms are what the device's manual calls a trip, a fault or a loss.
TEST(ShippedProfiles, DefineTheExpectedAlarms) {
  struct Row {
    const char* protocol;
    const char* profile;
    const char* alarms;
  };
  const Row rows[] = {
      {"spabus", "spaj140c", "E3 high, E7 high, E11 high, E15 high, internal_fault high"},
      {"spabus", "spau130c", "overvoltage_trip high, undervoltage_trip high, internal_fault high"},
      {"set4tm", "set-4tm.03m",
       "E71-72 medium, E81-82 medium, E91-92 medium, E101-102 medium, alarm medium"},
      {"set4tm", "set-4tm.02",
       "E71-72 medium, E81-82 medium, E91-92 medium, E101-102 medium, E601 medium"},
      {"modbus_rtu", "mitsubishi-fr-d700", "fault_text high"},
  };
  for (const Row& row : rows) {
    const auto loaded =
        config::LoadProfile(row.profile, *Shipped().FindProtocol(row.protocol), Shipped());
    std::string alarms;
    const auto add = [&](const std::string& name, config::AlarmPriority priority) {
      if (priority == config::AlarmPriority::none) return;
      alarms += (alarms.empty() ? "" : ", ") + name + " " + std::string(Name(priority));
    };
    for (const config::EventText& one : loaded.profile.event_texts) {
      add("E" + std::to_string(one.code) + (one.until ? "-" + std::to_string(*one.until) : ""),
          one.alarm);
    }
    for (const config::Point& point : loaded.profile.points) {
      for (const config::PointEvent& event : point.events) add(point.name, event.alarm);
    }
    EXPECT_EQ(alarms, row.alarms) << row.profile;
  }
}

using config::Group;

constexpr const char* kPoints =
    "device: D\npoints:\n"
    "- { name: phases, read: A1, type: uint16, group: slow }\n"
    "- { name: record1_a, read: A2, type: uint16, group: slow }\n"
    "- { name: record1_b, read: A3, type: uint16, group: fast }\n"
    "- { name: other, read: A4, type: uint16, group: slow }\n"
    "- { name: reset, write: A5, type: uint16, access: w }\n";

struct LoadedProfile {
  config::Profile profile;
  config::Device device;
  std::string problems;
};

LoadedProfile LoadKeys(const std::string& keys, bool events = true) {
  static const protocols::Protocol kProtocol = MakeFakeProtocol("fake");
  config::Problems problems;
  const auto raw = config::ReadProfileText(kPoints + keys, "p.yaml", "p", kProtocol, problems);
  LoadedProfile loaded{raw.profile, {}, {}};
  loaded.device.events = loaded.device.point_events = events;
  loaded.device.event_texts = raw.profile.event_texts;
  loaded.device.points = config::BuildPoints(raw.points, &kProtocol, problems);
  config::ResolveRecords(raw.profile.records, loaded.device, problems);
  loaded.problems = Shown(problems.Sorted());
  return loaded;
}

std::vector<Group> Groups(const LoadedProfile& loaded) {
  std::vector<Group> groups;
  for (const config::Point& point : loaded.device.points) groups.push_back(point.group);
  return groups;
}

constexpr const char* kTrip =
    "records: { trip: { points: [phases, 'record?_*'] } }\n"
    "events:\n- { code: 3, text: tripped, state: on, record: trip }\n- { code: 4, text: b }\n";

TEST(Records, ListTheirPointsWhichAreReadDaily) {
  const LoadedProfile loaded = LoadKeys(kTrip);
  ASSERT_EQ(loaded.problems, "");
  ASSERT_EQ(loaded.device.records.size(), 1U);
  EXPECT_EQ(loaded.device.records[0].name, "trip");
  EXPECT_THAT(loaded.device.records[0].points, ElementsAre(0U, 1U, 2U));
  EXPECT_EQ(loaded.profile.event_texts.at(0).record, "trip");
  EXPECT_EQ(loaded.profile.event_texts.at(1).record, "");
  EXPECT_THAT(Groups(loaded),
              ElementsAre(Group::daily, Group::daily, Group::fast, Group::slow, Group::fast));
}

TEST(Records, PointsKeepTheirGroupsWhenNoEventIsStored) {
  EXPECT_THAT(Groups(LoadKeys(kTrip, false)),
              ElementsAre(Group::slow, Group::slow, Group::fast, Group::slow, Group::fast));
  const LoadedProfile unused = LoadKeys("records: { trip: { points: [phases] } }\n");
  EXPECT_EQ(unused.problems, "");
  EXPECT_EQ(Groups(unused).front(), Group::slow) << "no event has it";
}

TEST(Records, ReportInvalidKeys) {
  EXPECT_THAT(LoadKeys("records: { trip: { points: [phase] } }\n").problems,
              HasSubstr("p.yaml:8:18: error: records: 'phase' of 'trip' matches no point"));
  EXPECT_THAT(LoadKeys("records: { trip: { points: [reset] } }\n").problems,
              HasSubstr("matches no point that can be read"));
  EXPECT_THAT(LoadKeys("records: { trip: {} }\n").problems, HasSubstr("points"));
  EXPECT_THAT(LoadKeys("records: { trip: { points: [phases], group: once } }\n").problems,
              HasSubstr("group"));
  EXPECT_THAT(LoadKeys("records: { trip: { points: [phases] } }\n"
                       "events: [{ code: 1, text: a, record: tripp }]\n")
                  .problems,
              HasSubstr("record: the profile has no record 'tripp'; did you mean 'trip'?"));
  EXPECT_THAT(LoadKeys("events: [{ code: 1, text: a, record: trip }]\n").problems,
              HasSubstr("records: none"));
}

constexpr const char* kFeeders =
    "lines:\n- { name: bay, port: /dev/l, protocol: fake, devices: [\n"
    "{ name: f1, address: 1, points: [{ name: current_l1, read: A1, type: float32, deadband: 0.25 "
    "}, "
    "{ name: group, read: A2, type: uint16 }] },\n"
    "{ name: f2, address: 2, points: [{ name: current_l1, read: A1, type: float32 }] }] }\n";

config::Loaded LoadHistory(const std::string& history) {
  return Load("history: " + history + "\n" + kFeeders);
}

std::vector<std::string> Names(const config::Loaded& loaded) {
  std::vector<std::string> names;
  for (const config::HistoryPoint& point : loaded.config.history.points) {
    const config::Device& device = loaded.config.lines.at(0).devices.at(point.device);
    names.push_back(device.name + "." + device.points.at(point.point).name);
  }
  return names;
}

TEST(HistoryPattern, MatchesStarsAndQuestionMarks) {
  EXPECT_TRUE(MatchesPattern("*", ""));
  EXPECT_TRUE(MatchesPattern("current_*", "current_l1"));
  EXPECT_TRUE(MatchesPattern("c*l?", "current_l1"));
  EXPECT_TRUE(MatchesPattern("*a*b", "aabab"));
  EXPECT_FALSE(MatchesPattern("*a*b", "aaba"));
  EXPECT_FALSE(MatchesPattern("current", "current_l1"));
  EXPECT_FALSE(MatchesPattern("?", ""));
}

TEST(HistoryKey, HistoryIsOffByDefault) {
  EXPECT_FALSE(Load(kFeeders).config.history.on());
  const auto loaded = LoadHistory("{ points: [ '*.*.*' ] }");
  EXPECT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(loaded.config.history.limit, 1'000'000'000U);
  EXPECT_EQ(loaded.config.history.keep, 365 * 24h);
  EXPECT_EQ(loaded.config.history.points.size(), 3U);
}

TEST(HistoryKey, TheFirstMatchingRuleDecides) {
  const auto loaded = LoadHistory(
      "{ max_gap: 1h, points: [ { match: bay.f2.*, log: off }, { match: 'bay.*.cur*', max_gap: "
      "2min }, { match: '*.*.*', log: all, deadband: 2 } ] }");
  EXPECT_EQ(Shown(loaded.problems), "");
  EXPECT_THAT(Names(loaded), ElementsAre("f1.current_l1", "f1.group"));
  const auto& points = loaded.config.history.points;
  EXPECT_EQ(points[0].deadband, 0.25) << "the point's own";
  EXPECT_EQ(points[0].max_gap, 2min);
  EXPECT_FALSE(points[0].every);
  EXPECT_EQ(points[1].deadband, 2);
  EXPECT_EQ(points[1].max_gap, 1h);
  EXPECT_TRUE(points[1].every);
}

}  // namespace
}  // namespace baudgate::testing
