// Tests which lines and settings a changed configuration restarts, and when a restart of the
// gateway is needed.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reload/difference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

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
  Action action;
  const char* named;
};

TEST(Difference, AllWebSettingsAreAppliedWithoutARestart) {
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

TEST(Difference, AChangedLineIsNamedAndLeavesTheOtherLinesUntouched) {
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
       Action::restarted, "device y-b is removed"},
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

TEST(Difference, LinesAreAddedRemovedAndReordered) {
  const Difference difference = After([](Config& config) {
    std::swap(config.lines[0], config.lines[1]);
    config.lines.pop_back();
    config.lines.insert(config.lines.begin(), LineOf("w"));
  });
  std::vector<std::pair<std::string, Action>> actions;
  for (const LineChange& line : difference.lines) actions.emplace_back(line.line, line.action);
  EXPECT_THAT(actions, ElementsAre(std::pair("w", Action::added), std::pair("y", Action::same),
                                   std::pair("x", Action::same), std::pair("z", Action::removed)));
  EXPECT_THAT(Sentences(difference), ElementsAre("line w: is new", "line z: is removed"));
  EXPECT_EQ(Summary(difference), "1 line new, 1 line removed; 2 lines untouched");
}

TEST(Difference, ARemovedLineIsNotCompared) {
  Config running = Sample();
  running.lines[0] = {};
  running.lines[0].devices.resize(2);
  Config next = Sample();
  next.lines.erase(next.lines.begin());
  EXPECT_TRUE(Compare(running, next).empty());
  EXPECT_EQ(Compare(running, Sample()).lines[0].action, Action::added);
}

TEST(Difference, SettingsThatNeedARestartAreNamed) {
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

TEST(Difference, ChangedListenersAndRoutesAreReported) {
  const Difference difference = After([](Config& config) {
    config.lines.pop_back();
    config.modbus.listen.resize(1);
    config.modbus.routes.resize(2);
    config.modbus.routes[1].line = config.modbus.routes[0].line = "x";
  });
  EXPECT_FALSE(difference.empty());
  EXPECT_EQ(WhyNot(difference), std::nullopt);
  EXPECT_THAT(Sentences(difference),
              ElementsAre("line z: is removed", "listener 127.0.0.1:1502: is new",
                          "route 1 to x: is new", "route 1 to x: is new"));
  EXPECT_EQ(Summary(difference), "1 line removed, 1 listener new, 2 routes new; 2 lines untouched");
}

TEST(Difference, TheOrderOfRoutesIsASetting) {
  Config running = Sample();
  running.modbus.routes.resize(2);
  running.modbus.routes[1].first = running.modbus.routes[1].last = 7;
  Config next = running;
  std::swap(next.modbus.routes[0], next.modbus.routes[1]);
  EXPECT_THAT(Sentences(Compare(running, next)),
              ElementsAre("the order of modbus.routes: changed"));
}

TEST(Difference, ListenersThatBlockEachOtherNeedARestart) {
  Config running = Sample();
  running.modbus.listen.resize(1);
  Config next = running;
  next.modbus.listen[0].host = "0.0.0.0";
  EXPECT_EQ(WhyNot(Compare(running, next)),
            "only a restart can change modbus.listen from 127.0.0.1:1502 to 0.0.0.0:1502");
}

TEST(Difference, HistoryPointsAreComparedByName) {
  Config running = Sample();
  running.history.points.push_back({.device = 2, .point = 1});  // device 2 is y-a, point 1 voltage
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

TEST(Difference, InterlocksAreComparedByName) {
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

using config::Modbus;

config::Listener ListenerAt(const std::string& host, std::uint16_t port) {
  config::Listener listener;
  listener.host = host;
  listener.port = port;
  return listener;
}

config::Listener MasterAt(const std::string& path) {
  config::Listener listener;
  listener.path = path;
  return listener;
}

config::Route RouteTo(const std::string& line, std::uint8_t first, std::uint8_t last) {
  config::Route route;
  route.first = first;
  route.last = last;
  route.line = line;
  return route;
}

Modbus SampleModbus() {
  Modbus modbus;
  modbus.listen = {ListenerAt("127.0.0.1", 1502), ListenerAt("10.0.0.1", 502),
                   MasterAt("/dev/ttyS1")};
  modbus.routes = {RouteTo("drive", 33, 40), RouteTo("pumps", 41, 41)};
  config::Route elsewhere = RouteTo("", 50, 50);
  elsewhere.host = "10.0.0.9";
  modbus.routes.push_back(elsewhere);
  return modbus;
}

using Change = std::function<void(Modbus&)>;

ModbusDifference After(const Change& change) {
  Modbus next = SampleModbus();
  change(next);
  return CompareModbus(SampleModbus(), next);
}

std::vector<std::string> Sentences(const ModbusDifference& difference) {
  std::vector<std::string> sentences;
  const auto tell = [&sentences](const auto& changes) {
    for (const auto& change : changes) {
      if (change.action != Action::same) sentences.push_back(SentenceOf(change));
    }
  };
  tell(difference.listeners);
  tell(difference.routes);
  return sentences;
}

struct ModbusCase {
  const char* what;
  Change change;
  std::vector<std::string> sentences;
};

TEST(ModbusDifference, ReportsOneSentenceForEachListener) {
  const ModbusCase cases[] = {
      {"nothing", [](Modbus&) {}, {}},
      {"its place in the file",
       [](Modbus& its) {
         its.listen[0].mark = {"other.yaml", 7, 3};
       },
       {}},
      {"the order", [](Modbus& its) { std::swap(its.listen[0], its.listen[2]); }, {}},
      {"what may be asked",
       [](Modbus& its) { its.listen[0].permit = config::Permit::read; },
       {"listener 127.0.0.1:1502: changed settings: write; its clients are disconnected"}},
      {"two settings, and another place",
       [](Modbus& its) {
         its.listen[1].allow.push_back({"10.0.0.0/8", {}, 104});
         its.listen[1].max_clients = 7;
         std::swap(its.listen[0], its.listen[1]);
       },
       {"listener 10.0.0.1:502: changed settings: allow, max_clients; its clients are "
        "disconnected"}},
      {"the rate of a serial port",
       [](Modbus& its) { its.listen[2].serial.baud = 1200; },
       {"listener /dev/ttyS1: changed settings: serial; its clients are disconnected"}},
      {"one more",
       [](Modbus& its) { its.listen.push_back(ListenerAt("10.0.0.2", 502)); },
       {"listener 10.0.0.2:502: is new"}},
      {"one less",
       [](Modbus& its) { its.listen.pop_back(); },
       {"listener /dev/ttyS1: ends; its clients are disconnected"}},
      {"another port",
       [](Modbus& its) { its.listen[1].port = 503; },
       {"listener 10.0.0.1:503: is new",
        "listener 10.0.0.1:502: ends; its clients are disconnected"}},
  };
  for (const ModbusCase& one : cases) {
    const ModbusDifference difference = After(one.change);
    EXPECT_EQ(Sentences(difference), one.sentences) << one.what;
    EXPECT_THAT(difference.restart, IsEmpty()) << one.what;
  }
}

TEST(ModbusDifference, ReportsThePreviousIndexOfEachListener) {
  const ModbusDifference difference = After([](Modbus& its) {
    its.listen.insert(its.listen.begin(), ListenerAt("10.0.0.2", 502));
    its.listen.erase(its.listen.begin() + 2);
  });
  std::vector<std::optional<std::size_t>> was;
  for (const ListenerChange& listener : difference.listeners) was.push_back(listener.was);
  EXPECT_THAT(was, ElementsAre(std::nullopt, 0U, 2U, 1U)) << "the last is the one that ends";
}

TEST(ModbusDifference, CountsTheClientsThatAListenerLoses) {
  ListenerChange change{"10.0.0.1:502", Action::restarted, "write", 0, 3};
  EXPECT_EQ(SentenceOf(change),
            "listener 10.0.0.1:502: changed settings: write; its 3 clients are disconnected");
  change.clients = 1;
  EXPECT_EQ(SentenceOf(change),
            "listener 10.0.0.1:502: changed settings: write; its client is disconnected");
  change.clients = 0;
  EXPECT_EQ(SentenceOf(change), "listener 10.0.0.1:502: changed settings: write");
}

TEST(ModbusDifference, ReportsOneSentenceForEachRoute) {
  const ModbusCase cases[] = {
      {"one more",
       [](Modbus& its) { its.routes.insert(its.routes.begin(), RouteTo("drive", 9, 9)); },
       {"route 9 to drive: is new"}},
      {"one less",
       [](Modbus& its) { its.routes.erase(its.routes.begin()); },
       {"route 33-40 to drive: ends"}},
      {"its numbers on the line",
       [](Modbus& its) {
         its.routes[0].remap = 1;
         its.routes[0].deadline = 5s;
       },
       {"route 33-40 to drive: restarts with changed remap, deadline"}},
      {"its alarms",
       [](Modbus& its) { its.routes[0].alarms.delay = 5s; },
       {"route 33-40 to drive: continues, with changed alarms"}},
      {"another server",
       [](Modbus& its) { its.routes[2].port = 503; },
       {"route 50 to 10.0.0.9:503: is new", "route 50 to 10.0.0.9:502: ends"}},
      {"the number of its line", [](Modbus& its) { its.routes[0].line_index = 7; }, {}},
      {"one that stands twice",
       [](Modbus& its) { its.routes.push_back(its.routes[0]); },
       {"route 33-40 to drive: is new"}},
  };
  for (const ModbusCase& one : cases) {
    const ModbusDifference difference = After(one.change);
    EXPECT_EQ(Sentences(difference), one.sentences) << one.what;
    EXPECT_FALSE(difference.route_order) << one.what;
  }
}

TEST(ModbusDifference, DetectsAChangedOrderOfRoutes) {
  const ModbusDifference difference =
      After([](Modbus& its) { std::swap(its.routes[0], its.routes[2]); });
  EXPECT_TRUE(difference.route_order);
  EXPECT_THAT(Sentences(difference), IsEmpty());
  std::vector<std::optional<std::size_t>> was;
  for (const RouteChange& route : difference.routes) was.push_back(route.was);
  EXPECT_THAT(was, ElementsAre(2U, 1U, 0U));
}

TEST(ModbusDifference, PortsThatBlockEachOtherNeedARestart) {
  struct Ports {
    const char* was;
    const char* is;
    bool block;
  };
  const Ports cases[] = {{"10.0.0.1", "0.0.0.0", true},
                         {"0.0.0.0", "10.0.0.1", true},
                         {"10.0.0.1", "10.0.0.2", false},
                         {"10.0.0.1", "::", true},
                         {"::", "0.0.0.0", true},
                         {"::1", "0.0.0.0", false},
                         {"::", "::1", true}};
  for (const Ports& one : cases) {
    Modbus running;
    running.listen = {ListenerAt(one.was, 502)};
    Modbus next;
    next.listen = {ListenerAt(one.is, 502)};
    const auto restart = CompareModbus(running, next).restart;
    EXPECT_EQ(!restart.empty(), one.block) << one.was << " " << one.is;
    next.listen[0].port = 503;
    EXPECT_THAT(CompareModbus(running, next).restart, IsEmpty()) << "another port";
  }
  Modbus running = SampleModbus();
  Modbus next = SampleModbus();
  next.listen[1].host = "0.0.0.0";
  EXPECT_THAT(CompareModbus(running, next).restart,
              ElementsAre("modbus.listen from 10.0.0.1:502 to 0.0.0.0:502"));
}

TEST(ModbusDifference, IgnoresAnOutputThatIsOff) {
  Modbus off = SampleModbus();
  off.enabled = false;
  EXPECT_THAT(CompareModbus(off, SampleModbus()).listeners, IsEmpty());
  EXPECT_THAT(CompareModbus(SampleModbus(), off).routes, IsEmpty());
}

std::vector<std::string> Names(const Config& config) {
  std::vector<std::string> names;
  for (const config::Line& line : config.lines) names.push_back(line.name);
  return names;
}

Placement Placed(const Config& running, const Config& next) {
  return PlaceInSlots(running, next, Compare(running, next));
}

TEST(Placement, AnUnchangedLineKeepsItsNumber) {
  Config next = Sample();
  std::swap(next.lines[0], next.lines[2]);
  const Placement placed = Placed(Sample(), next);
  EXPECT_THAT(Names(placed.config), ElementsAre("x", "y", "z"));
  EXPECT_THAT(placed.gone, IsEmpty());
  EXPECT_THAT(placed.updated, IsEmpty());
  EXPECT_THAT(placed.begun, IsEmpty());
}

TEST(Placement, AnEndedLineLeavesAnEmptyPlaceAndANewLineGetsTheNext) {
  Config next = Sample();
  next.lines[0].port = "/dev/other";
  next.lines.erase(next.lines.begin() + 1);
  next.lines.insert(next.lines.begin(), LineOf("w"));
  const Placement placed = Placed(Sample(), next);
  EXPECT_THAT(Names(placed.config), ElementsAre("", "", "z", "w", "x"));
  EXPECT_EQ(placed.config.lines[0].devices.size(), 2U);
  EXPECT_FALSE(placed.config.lines[0].devices[0].unit);
  EXPECT_THAT(placed.gone, ElementsAre(0U, 1U));
  EXPECT_THAT(placed.begun, ElementsAre(3U, 4U));
  EXPECT_EQ(placed.config.lines[4].port, "/dev/other");

  const Placement again = Placed(placed.config, Sample());
  EXPECT_THAT(Names(again.config), ElementsAre("", "", "z", "", "", "x", "y"));
  EXPECT_THAT(again.gone, ElementsAre(3U, 4U)) << "and not those that are gone already";
  EXPECT_THAT(again.begun, ElementsAre(5U, 6U));
}

TEST(Placement, LinesWithChangedDisplaySettingsAreNamed) {
  Config next = Sample();
  next.lines[1].devices[0].unit = 7;
  const Placement placed = Placed(Sample(), next);
  EXPECT_THAT(placed.updated, ElementsAre(1U));
  EXPECT_EQ(placed.config.lines[1].devices[0].unit, 7);
}

TEST(Placement, ReferencesToDevicesAndLinesAreRenumbered) {
  const auto with_numbers = [](Config config, std::uint32_t device, std::size_t line) {
    config.history.points.push_back({.device = device, .point = 1});
    config::Route route;
    route.line = "y";
    route.line_index = line;
    config.modbus.routes.push_back(route);
    for (config::Line& one : config.lines) {
      if (one.name != "z") continue;
      one.devices[0].points[0].writing.allow_when = {
          {.point = "y.y-b.current", .is = true, .device = device}};
    }
    return config;
  };
  const Config running = with_numbers(Sample(), 3, 1);  // number 3 is device y-b
  Config next = Sample();
  next.lines.erase(next.lines.begin());
  next.lines[0].port = "/dev/other";
  const Placement placed = Placed(running, with_numbers(next, 1, 0));
  EXPECT_THAT(Names(placed.config), ElementsAre("", "", "z", "y"));
  EXPECT_EQ(placed.config.history.points[0].device, 7U);
  EXPECT_EQ(placed.config.modbus.routes[0].line_index, 3U);
  EXPECT_EQ(placed.config.lines[2].devices[0].points[0].writing.allow_when[0].device, 7U);
  EXPECT_THAT(placed.updated, ElementsAre(2U)) << "its interlock looks at another number";
}

}  // namespace
}  // namespace baudgate::reload
