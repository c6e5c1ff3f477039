// What a changed configuration does to which line, and what it needs a restart for.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reload/difference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/gateway/daemon/reload/sample_config.h"

namespace baudgate::reload {
namespace {

using config::Config;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Difference After(const std::function<void(Config&)>& change) {
  Config next = Sample();
  change(next);
  return Compare(Sample(), next);
}

struct LineCase {
  const char* what;
  std::function<void(Config&)> change;
  Action action;  // of line y
  const char* named;
};

TEST(Difference, OfTheWebServerIsAllApplied) {
  const Config running;
  Config next = running;
  next.web.on = true;
  EXPECT_THAT(Compare(running, next).settings, ElementsAre("web"));
  next.web.on = false;
  next.web.listen.port = 80;
  next.web.token_file = "/t";
  EXPECT_THAT(Compare(running, next).settings, ElementsAre("web.listen", "web.token"));
  EXPECT_THAT(Compare(running, next).restart, IsEmpty());
  EXPECT_FALSE(Compare(running, next).empty());
}

TEST(Difference, OfOneLineIsNamedAndTouchesNoOther) {
  const LineCase cases[] = {
      {"nothing", [](Config&) {}, Action::same, ""},
      {"its place in the file",
       [](Config& config) {
         config.lines[1].mark = {"other.yaml", 7, 3};
       },
       Action::same, ""},
      {"the port", [](Config& config) { config.lines[1].port = "/dev/q"; }, Action::restarted,
       "port"},
      {"the rate", [](Config& config) { config.lines[1].serial.baud = 1200; }, Action::restarted,
       "serial"},
      {"a period", [](Config& config) { config.lines[1].devices[1].poll = 5s; }, Action::restarted,
       "poll of y-b"},
      {"a scale", [](Config& config) { config.lines[1].devices[0].points[1].scale = 2; },
       Action::restarted, "scale of y-a.voltage"},
      {"a permission",
       [](Config& config) { config.lines[1].devices[0].points[0].writing.allowed = true; },
       Action::restarted, "write of y-a.current"},
      {"an option", [](Config& config) { config.lines[1].options.Set("checksum", true); },
       Action::restarted, "options"},
      {"a new point",
       [](Config& config) { config.lines[1].devices[0].points.push_back(PointOf("power")); },
       Action::restarted, "y-a.power is new"},
      {"one device less", [](Config& config) { config.lines[1].devices.pop_back(); },
       Action::restarted, "device y-b is gone"},
      {"the order of devices",
       [](Config& config) { std::swap(config.lines[1].devices[0], config.lines[1].devices[1]); },
       Action::restarted, "order"},
      {"a unit", [](Config& config) { config.lines[1].devices[0].unit = 9; }, Action::in_place,
       "unit of y-a"},
      {"a register", [](Config& config) { config.lines[1].devices[0].points[0].modbus = 40; },
       Action::in_place, "modbus of y-a.current"},
      {"a deadband", [](Config& config) { config.lines[1].devices[0].points[0].deadband = 0.5; },
       Action::in_place, "deadband of y-a.current"},
      {"what bad values are",
       [](Config& config) { config.lines[1].devices[0].on_bad = config::OnBad::hold; },
       Action::in_place, "on_bad of y-a"},
      {"when values are old", [](Config& config) { config.lines[1].devices[0].max_age = 9s; },
       Action::in_place, "max_age of y-a"},
      {"and when they are given up",
       [](Config& config) { config.lines[1].devices[0].dead_age = 9s; }, Action::in_place,
       "dead_age of y-a"},
      {"an alarm of the line", [](Config& config) { config.lines[1].alarms.delay = 5s; },
       Action::in_place, "alarms"},
      {"an alarm of a device",
       [](Config& config) {
         config.lines[1].devices[0].alarms.priority = config::AlarmPriority::none;
       },
       Action::in_place, "alarms of y-a"},
      {"a unit and a period",
       [](Config& config) {
         config.lines[1].devices[0].unit = 9;
         config.lines[1].devices[0].poll = 5s;
       },
       Action::restarted, "unit of y-a, poll of y-a"},
  };
  for (const LineCase& one : cases) {
    const Difference difference = After(one.change);
    ASSERT_EQ(difference.lines.size(), 3U) << one.what;
    EXPECT_EQ(difference.lines[1].action, one.action) << one.what;
    EXPECT_THAT(difference.lines[1].what, HasSubstr(one.named)) << one.what;
    EXPECT_EQ(difference.lines[0].action, Action::same) << one.what;
    EXPECT_EQ(difference.lines[2].action, Action::same) << one.what;
    EXPECT_THAT(difference.restart, IsEmpty()) << one.what;
    EXPECT_EQ(difference.empty(), one.action == Action::same) << one.what;
  }
}

TEST(Difference, AlarmsOfTheGatewayAreASetting) {
  const Difference difference = After([](Config& config) { config.alarms.delay = 5s; });
  EXPECT_THAT(Sentences(difference), ElementsAre("gateway.alarms: changed"));
  EXPECT_EQ(WhyNot(difference), std::nullopt);
}

TEST(Difference, LinesComeGoAndChangePlaces) {
  const Difference difference = After([](Config& config) {
    std::swap(config.lines[0], config.lines[1]);
    config.lines.pop_back();
    config.lines.insert(config.lines.begin(), LineOf("w"));
  });
  std::vector<std::pair<std::string, Action>> actions;
  for (const LineChange& line : difference.lines) actions.emplace_back(line.line, line.action);
  EXPECT_THAT(actions, ElementsAre(std::pair("w", Action::added), std::pair("y", Action::same),
                                   std::pair("x", Action::same), std::pair("z", Action::removed)));
  EXPECT_THAT(Sentences(difference), ElementsAre("line w: is new", "line z: ends"));
  EXPECT_EQ(Summary(difference), "1 line new, 1 line ended; 2 lines untouched");
}

TEST(Difference, ALineThatIsGoneIsNoLine) {
  Config running = Sample();
  running.lines[0] = {};
  running.lines[0].devices.resize(2);
  Config next = Sample();
  next.lines.erase(next.lines.begin());
  EXPECT_TRUE(Compare(running, next).empty());
  EXPECT_EQ(Compare(running, Sample()).lines[0].action, Action::added);
}

TEST(Difference, WhatOnlyARestartCanChangeIsNamed) {
  const std::pair<std::function<void(Config&)>, const char*> cases[] = {
      {[](Config& config) { config.name = "other"; }, "gateway.name"},
      {[](Config& config) { config.state = "/srv"; }, "gateway.state"},
      {[](Config& config) { config.recordings = "/srv"; }, "gateway.recordings"},
      {[](Config& config) { config.socket = "/run/x"; }, "gateway.socket"},
      {[](Config& config) { config.audit = config::Audit::require; }, "gateway.audit"},
      {[](Config& config) { config.events.given = true; }, "events"},
      {[](Config& config) { config.modbus.enabled = false; }, "modbus.enabled"},
      {[](Config& config) { config.dds.domain = 7; }, "dds.domain"},
      {[](Config& config) { config.dds.heartbeat = 1s; }, "dds.heartbeat"},
      {[](Config& config) { config.dds.security.key = "k.pem"; }, "dds.security"},
      {[](Config& config) { config.history.directory = "/srv"; }, "history.directory"},
  };
  for (const auto& [change, name] : cases) {
    const Difference difference = After(change);
    EXPECT_THAT(difference.restart, ElementsAre(name));
    EXPECT_EQ(WhyNot(difference), std::string("only a restart can change ") + name);
    EXPECT_FALSE(difference.empty());
  }
  EXPECT_EQ(WhyNot(After([](Config&) {})), std::nullopt);
}

TEST(Difference, OfListenersAndRoutesIsTold) {
  const Difference difference = After([](Config& config) {
    config.lines.pop_back();
    config.modbus.listen.resize(1);
    config.modbus.routes.resize(2);
    config.modbus.routes[1].line = config.modbus.routes[0].line = "x";
  });
  EXPECT_FALSE(difference.empty());
  EXPECT_EQ(WhyNot(difference), std::nullopt);
  EXPECT_THAT(Sentences(difference), ElementsAre("line z: ends", "listener 127.0.0.1:1502: is new",
                                                 "route 1 to x: is new", "route 1 to x: is new"));
  EXPECT_EQ(Summary(difference), "1 line ended, 1 listener new, 2 routes new; 2 lines untouched");
}

TEST(Difference, OfTheOrderOfRoutesIsASetting) {
  Config running = Sample();
  running.modbus.routes.resize(2);
  running.modbus.routes[1].first = running.modbus.routes[1].last = 7;
  Config next = running;
  std::swap(next.modbus.routes[0], next.modbus.routes[1]);
  EXPECT_THAT(Sentences(Compare(running, next)),
              ElementsAre("the order of modbus.routes: changed"));
}

TEST(Difference, OfPortsThatBlockEachOtherNeedsARestart) {
  Config running = Sample();
  running.modbus.listen.resize(1);
  Config next = running;
  next.modbus.listen[0].host = "0.0.0.0";
  EXPECT_EQ(WhyNot(Compare(running, next)),
            "only a restart can change modbus.listen from 127.0.0.1:1502 to 0.0.0.0:1502");
}

TEST(Difference, OfTheHistoryIsByNameAndNotByNumber) {
  Config running = Sample();
  running.history.points.push_back({.device = 2, .point = 1});  // y-a.voltage
  Config next = Sample();
  std::swap(next.lines[0], next.lines[1]);
  next.history.points.push_back({.device = 0, .point = 1});
  EXPECT_TRUE(Compare(running, next).empty());
  next.history.points[0].every = true;
  EXPECT_THAT(Compare(running, next).settings, ElementsAre("history.points"));
  next.history.points[0].every = false;
  next.history.points[0].point = 0;
  EXPECT_THAT(Compare(running, next).settings, ElementsAre("history.points"));
  next.history.keep = 48h;
  EXPECT_THAT(Compare(running, next).settings, ElementsAre("history.keep", "history.points"));
}

/// What it looks at has another number and is the same.
TEST(Difference, OfAnInterlockIsByName) {
  Config running = Sample();
  Config next = Sample();
  for (auto [config, device] : {std::pair(&running, 4U), std::pair(&next, 0U)}) {
    config->lines[1].devices[0].points[0].writing.allow_when = {
        {.point = "z.z-a.current", .is = true, .device = device}};
  }
  EXPECT_TRUE(Compare(running, next).empty());
  next.lines[1].devices[0].points[0].writing.allow_when[0].is = false;
  EXPECT_EQ(Compare(running, next).lines[1].action, Action::restarted);
}

}  // namespace
}  // namespace baudgate::reload
