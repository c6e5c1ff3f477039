// The keys alarms: and event_alarms:, and which alarms shipped profiles raise.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <string>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;

std::string TextOf(const config::AlarmSetting& alarms) {
  return (alarms.on() ? std::string(Name(alarms.priority)) : "off") + " " +
         FormatDuration(alarms.delay);
}

TEST(AlarmsKey, TheMoreSpecificSettingWinsEachKeyByItself) {
  struct Row {
    const char* gateway;
    const char* line;
    const char* device;
    const char* route;
    const char* are;  // of all four
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

std::string ProblemsWith(const std::string& keys, const std::string& top = "events: {}\n") {
  return Shown(config::LoadText(top +
                                    "lines: [{ name: l, port: /dev/l, protocol: spabus, devices: "
                                    "[\n{ name: d, address: 1, profile: spaj140c, " +
                                    keys + " }] }]\n",
                                "t.yaml", Shipped())
                   .problems);
}

TEST(AlarmsKey, OneSentenceEach) {
  struct Row {
    const char* keys;
    const char* problem;
  };
  const Row rows[] = {
      {"alarms: hihg",
       "t.yaml:3:51: error: alarms: 'hihg' is unknown; did you mean 'high'? allowed: high, medium, "
       "low, off\n"},
      {"alarms: { delay: 30 }",
       "t.yaml:3:60: error: delay: '30' has no unit; write for example 30ms or 30s\n"},
      {"alarms: { wait: 30s }",
       "t.yaml:3:53: error: unknown key 'wait' in alarms; allowed: priority, delay\n"},
      {"event_alarms: { E4: high }",
       "t.yaml:3:63: error: event_alarms: 'E4' is the end of something and raises no alarm; name "
       "the event that begins it: E1, E3, E5"},
      {"event_alarms: { E99: high }",
       "t.yaml:3:64: error: event_alarms: 'spaj140c' has no event 'E99';"},
      {"event_alarms: { V3: high }",
       "t.yaml:3:63: error: event_alarms: 'V3' names no event; write channel and code, \"2E17\", "
       "or \"E17\" for every channel\n"},
      {"event_alarms: { E3: loud }", "t.yaml:3:63: error: event_alarms: 'loud' is unknown;"},
      {"event_alarms: E3", "t.yaml:3:57: error: event_alarms: expected a map"},
  };
  for (const Row& row : rows) EXPECT_THAT(ProblemsWith(row.keys), HasSubstr(row.problem));
  EXPECT_THAT(ProblemsWith("event_alarms: { E3: high }", ""),
              HasSubstr("warning: event_alarms: the events of 'd' are not asked for"));
  EXPECT_THAT(Shown(Load("lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, "
                         "address: 1, event_alarms: { E3: high }, points: [{ name: a, read: A1, "
                         "type: uint16 }] }] }\n")
                        .problems),
              HasSubstr("event_alarms: there is no profile with a table of events"));
}

TEST(EventAlarms, ChangeRowsOfTheTable) {
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

/// What the document of a device calls a trip, a fault or a loss.
TEST(ShippedProfiles, RaiseAlarms) {
  struct Row {
    const char* protocol;
    const char* profile;
    const char* alarms;  // codes of events, then points
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

}  // namespace
}  // namespace baudgate::testing
