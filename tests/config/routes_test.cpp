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

/// The routes stand in line 2 from column 12 on; the two at the end keep the lines in use.
config::Loaded LoadRoutes(const std::string& routes) {
  return LoadModbus("modbus: {\n  routes: [ " + routes +
                    ", { units: 201, line: drive }, { units: 202, line: text } ] }\n" +
                    kRoutedLines);
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

TEST(Routes, OrderIsKept) {
  const auto loaded = LoadRoutes("{ units: 9, line: text }, { units: 7, line: drive }");
  ASSERT_EQ(loaded.config.modbus.routes.size(), 4U);
  EXPECT_EQ(loaded.config.modbus.routes[0].first, 9);
  EXPECT_EQ(loaded.config.modbus.routes[1].first, 7);
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
