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
