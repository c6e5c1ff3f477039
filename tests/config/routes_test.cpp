// modbus.routes: what they come to, what is refused, and which of their units they do not get.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "config/model/config.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::Route;

constexpr const char* kRoutedLines =
    "lines:\n"
    "- { name: bay, port: /dev/a, protocol: fake, devices: [{ name: d, address: 1, unit: 36, "
    "profile: relay }] }\n"
    "- { name: drive, port: /dev/b, protocol: modbus_rtu }\n"
    "- { name: text, port: /dev/c, protocol: modbus_ascii }\n";

constexpr const char* kUnused =
    "t.yaml:5:3: warning: line 'drive' has no devices, and no route leads to it: nothing is asked "
    "on it\n"
    "t.yaml:6:3: warning: line 'text' has no devices, and no route leads to it: nothing is asked "
    "on it\n";

/// The routes stand in line 2 from column 12 on; the two at the end keep the lines in use.
config::Loaded LoadRoutes(const std::string& routes, const std::string& modbus = "") {
  return LoadModbus("modbus: { " + modbus + "\n  routes: [ " + routes +
                    ", { units: 201, line: drive }, { units: 202, line: text } ] }\n" +
                    kRoutedLines);
}

std::string ProblemsOfRoutes(const std::string& routes) {
  return Shown(LoadRoutes(routes).problems);
}

Route One(const std::string& keys) {
  const auto loaded = LoadRoutes("{ " + keys + " }");
  EXPECT_EQ(Shown(loaded.problems), "") << keys;
  return loaded.config.modbus.routes.at(0);
}

TEST(Routes, ToALine) {
  const Route route = One("units: \"20\", line: drive");
  EXPECT_EQ(route.first, 20);
  EXPECT_EQ(route.last, 20);
  EXPECT_EQ(route.line, "drive");
  EXPECT_EQ(route.line_index, 1U);
  EXPECT_EQ(route.host, "");
  EXPECT_FALSE(route.remap);
  EXPECT_EQ(route.deadline, 2500ms);
  EXPECT_EQ(route.mark.ToString(), "t.yaml:2:13");
  EXPECT_EQ(One("units: 20, line: text").line_index, 2U);
}

TEST(Routes, RangesAndRemap) {
  const Route route = One("units: \"37-40\", line: drive, remap: 1, deadline: 1s");
  EXPECT_EQ(route.Units(), "37-40");
  EXPECT_EQ(route.SlaveOf(37), 1);
  EXPECT_EQ(route.SlaveOf(40), 4);
  EXPECT_EQ(route.deadline, 1s);
  EXPECT_EQ(One("units: 37 - 40, line: drive").Units(), "37-40");
  EXPECT_EQ(One("units: 1, line: drive, remap: 247").SlaveOf(1), 247);
  EXPECT_EQ(One("units: 250-255, line: drive, remap: 242").SlaveOf(255), 247);
  EXPECT_EQ(One("units: 248-255, line: drive").SlaveOf(255), 255) << "some slaves are there";
  EXPECT_EQ(One("units: 1, line: drive, remap: 255").SlaveOf(1), 255);
}

TEST(Routes, ToAServer) {
  const Route route = One("units: \"50-59\", server: \"10.0.0.9:1502\", deadline: 50ms");
  EXPECT_EQ(route.line, "");
  EXPECT_EQ(route.host, "10.0.0.9");
  EXPECT_EQ(route.port, 1502);
  EXPECT_EQ(route.deadline, 50ms);
  EXPECT_EQ(One("units: 50, server: 10.0.0.9").port, 502);
  EXPECT_EQ(One("units: 50, server: plc").host, "plc");
  EXPECT_EQ(One("units: 255, server: plc, remap: 1").SlaveOf(255), 1);
  EXPECT_EQ(One("units: 248-254, server: plc, remap: 249").SlaveOf(254), 255);
  EXPECT_EQ(One("units: 50, server: plc, remap: 0").SlaveOf(50), 0);
  EXPECT_EQ(One("units: 0, server: plc, remap: 0").SlaveOf(0), 0) << "a write is no broadcast then";
}

TEST(Routes, UnitZeroAsItIsOrRewritten) {
  EXPECT_EQ(One("units: 0, line: drive").SlaveOf(0), 0);
  EXPECT_EQ(One("units: 0, line: drive, remap: 1").SlaveOf(0), 1);
  EXPECT_EQ(One("units: 0-5, line: drive").first, 0);
}

TEST(Routes, ToServersNeedNoLines) {
  const auto loaded = LoadModbus("modbus: { routes: [{ units: 50, server: plc }] }\n");
  EXPECT_EQ(Shown(loaded.problems), "");
  EXPECT_TRUE(loaded.config.lines.empty());
  EXPECT_NE(Shown(LoadModbus("modbus: { routes: [] }\n").problems), "");
  EXPECT_NE(Shown(LoadModbus("modbus: {}\n").problems), "");
}

TEST(Routes, OrderIsKept) {
  const auto loaded = LoadRoutes("{ units: 9, line: text }, { units: 7, line: drive }");
  ASSERT_EQ(loaded.config.modbus.routes.size(), 4U);
  EXPECT_EQ(loaded.config.modbus.routes[0].first, 9);
  EXPECT_EQ(loaded.config.modbus.routes[1].first, 7);
}

TEST(Routes, LinesMayStandFirst) {
  const auto loaded = LoadModbus(
      "lines: [{ name: drive, port: /dev/b, protocol: modbus_rtu }]\n"
      "modbus: { routes: [{ units: 20, line: drive }] }\n");
  EXPECT_EQ(Shown(loaded.problems), "");
}

TEST(Routes, OneSentenceEach) {
  const struct {
    const char* route;
    const char* problem;
  } kCases[] = {
      {"7", "13: error: a route: expected a map (key: value), found a single value"},
      {"{ line: drive }", "13: error: a route needs 'units'; for example units: 20"},
      {"{ units: 20 }",
       "13: error: a route needs 'line' or 'server'; for example line: drive or server: "
       "\"10.0.0.9:502\""},
      {"{ units: 20, line: drive, server: x }",
       "47: error: server: the route has a line already; remove one of the two keys"},
      {"{ units: 20, lien: drive, line: drive }",
       "26: error: unknown key 'lien' in a route; did you mean 'line'? allowed: units, line, "
       "server, remap, deadline, alarms"},
      {"{ units: [20], line: drive }", "22: error: units: expected a single value, found a list"},
      {"{ units: all, line: drive }",
       "22: error: units: 'all' is neither a unit id nor a range of them; write for example 20 or "
       "\"33-40\""},
      {"{ units: 1-2-3, line: drive }",
       "22: error: units: '1-2-3' is neither a unit id nor a range of them; write for example 20 "
       "or \"33-40\""},
      {"{ units: -5, line: drive }",
       "22: error: units: '-5' is neither a unit id nor a range of them; write for example 20 or "
       "\"33-40\""},
      {"{ units: 020, line: drive }",
       "22: error: units: '020': 020 has a leading zero: it is 20 in YAML 1.2, and 16 in YAML 1.1; "
       "write 20 or 16"},
      {"{ units: 256, line: drive }", "22: error: units: '256' is out of range; allowed: 0…255"},
      {"{ units: 200-256, line: drive }",
       "22: error: units: '200-256' is out of range; allowed: 0…255"},
      {"{ units: 40-33, line: drive }",
       "22: error: units: '40-33' is upside down; write \"33-40\""},
      {"{ units: 20, line: driv }",
       "32: error: line: there is no line 'driv'; did you mean 'drive'? lines: bay, drive, text"},
      {"{ units: 20, line: \"\" }",
       "32: error: line: there is no line ''; lines: bay, drive, text"},
      {"{ units: 20, line: bay }",
       "32: error: line: 'bay' speaks fake, which carries no Modbus requests; installed protocols "
       "that do: modbus_ascii, modbus_rtu"},
      {"{ units: 20, server: \"x:y\" }",
       "34: error: server: 'x:y' has no usable port number; allowed: 1…65535"},
      {"{ units: 20, server: \"\" }",
       "34: error: server: '' is not a server; write for example 10.0.0.9:502"},
      {"{ units: 20, server: \"127.0.0.1:1502\" }",
       "34: error: server: 127.0.0.1:1502 is this gateway itself: its requests would go in a "
       "circle; name the line, or another server"},
      {"{ units: 20, server: \"localhost:1502\" }",
       "34: error: server: 127.0.0.1:1502 is this gateway itself: its requests would go in a "
       "circle; name the line, or another server"},
      {"{ units: 20, line: drive, remap: 0 }",
       "46: error: remap: 20 would become 0; slaves of a line are 1…255"},
      {"{ units: 37-40, line: drive, remap: 253 }",
       "49: error: remap: 37-40 would become 253…256; slaves of a line are 1…255"},
      {"{ units: 0-9, server: x, remap: 247 }",
       "45: error: remap: 0-9 would become 247…256; unit ids are 0…255"},
      {"{ units: 20, line: drive, remap: 20 }",
       "46: error: remap: 20 changes nothing; remove the key"},
      {"{ units: 20, line: drive, remap: 256 }",
       "46: error: remap: '256' is out of range; allowed: 0…255"},
      {"{ units: 20, line: drive, deadline: 49ms }",
       "49: error: deadline: '49ms' is out of range; allowed: 50ms…1min"},
      {"{ units: 20, line: drive, deadline: 61s }",
       "49: error: deadline: '61s' is out of range; allowed: 50ms…1min"},
  };
  for (const auto& one : kCases) {
    EXPECT_EQ(ProblemsOfRoutes(one.route), "t.yaml:2:" + std::string(one.problem) + "\n")
        << one.route;
  }
}

TEST(Routes, ListIsNeeded) {
  EXPECT_EQ(
      Shown(LoadModbus(std::string("modbus: { routes: 20 }\n\n") + kRoutedLines).problems),
      "t.yaml:1:19: error: routes: expected a list, found a single value\n" + std::string(kUnused));
  EXPECT_EQ(Shown(LoadModbus(std::string("modbus: { routes: [] }\n\n") + kRoutedLines).problems),
            kUnused);
}

TEST(Routes, ServerBehindAnyAddressOfThisMachine) {
  const auto problems = [](const std::string& listen) {
    return Shown(
        LoadRoutes("{ units: 20, server: 127.0.0.1 }", "listen: " + listen + ",").problems);
  };
  EXPECT_EQ(problems("\"0.0.0.0:502\""),
            "t.yaml:2:34: error: server: 0.0.0.0:502 is this gateway itself: its requests would go "
            "in a circle; name the line, or another server\n");
  EXPECT_EQ(problems("\"0.0.0.0:503\""), "");
  EXPECT_EQ(problems("\"10.0.0.1:502\""), "");
  EXPECT_EQ(problems("/dev/m"), "");
}

TEST(RouteWarnings, EarlierRoutesAndDevices) {
  EXPECT_EQ(ProblemsOfRoutes("{ units: 20, line: drive },\n { units: 20, line: text }"),
            "t.yaml:3:2: warning: route for 20 is never used, its units are taken: 20 by the route "
            "in line 2\n");
  EXPECT_EQ(ProblemsOfRoutes("{ units: 30-34, line: drive },\n { units: 33-40, line: text }"),
            "t.yaml:3:2: warning: route for 33-40 does not get all of its units: 33-34 by the "
            "route in line 2\n");
  EXPECT_EQ(ProblemsOfRoutes("{ units: 20, line: drive },\n { units: 1-100, line: text }"), "")
      << "single units before a route for all the others";
  EXPECT_EQ(ProblemsOfRoutes("{ units: 36, line: drive }"),
            "t.yaml:2:13: warning: route for 36 is never used, its units are taken: 36 by device "
            "'d'\n");
  EXPECT_EQ(
      ProblemsOfRoutes("{ units: 20-30, line: drive },\n{ units: 25, line: drive },\n{ units: "
                       "25-31, line: drive }"),
      "t.yaml:3:1: warning: route for 25 is never used, its units are taken: 25 by the route "
      "in line 2\n"
      "t.yaml:4:1: warning: route for 25-31 does not get all of its units: 25-30 by the route "
      "in line 2\n");
}

TEST(RouteWarnings, DeadlineBelowTheReplyTime) {
  EXPECT_EQ(ProblemsOfRoutes("{ units: 20, line: drive, deadline: 499ms }"),
            "t.yaml:2:13: warning: route for 20: deadline 499ms is shorter than line 'drive' waits "
            "for a reply (500ms): slow replies would come too late; lengthen it, or shorten the "
            "line's timing: { reply: … }\n");
  EXPECT_EQ(ProblemsOfRoutes("{ units: 20, line: drive, deadline: 500ms }"), "");
  EXPECT_EQ(ProblemsOfRoutes("{ units: 20, server: x, deadline: 50ms }"), "");
}

TEST(RouteWarnings, ModbusSwitchedOff) {
  EXPECT_EQ(Shown(LoadRoutes("{ units: 20, line: drive }", "enabled: false,").problems),
            "t.yaml:2:11: warning: routes: Modbus is switched off (enabled: false): no request "
            "reaches them\n");
}

TEST(RouteWarnings, LinesWithoutDevicesAndRoute) {
  EXPECT_EQ(Shown(LoadModbus(std::string("modbus: { enabled: true }\n\n") + kRoutedLines).problems),
            kUnused);
}

TEST(Units, AsText) {
  const auto text = [](std::initializer_list<std::size_t> units) {
    config::UnitSet set;
    for (const std::size_t unit : units) set.set(unit);
    return config::UnitsText(set);
  };
  EXPECT_EQ(text({}), "");
  EXPECT_EQ(text({0}), "0");
  EXPECT_EQ(text({33, 34, 35, 37, 254, 255}), "33-35, 37, 254-255");
}

}  // namespace
}  // namespace baudgate::testing
