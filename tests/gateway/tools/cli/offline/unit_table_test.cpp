// What `baudgate check` prints of listeners and routes, letter by letter.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/cli/offline/check_parts.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;

constexpr const char* kLines =
    "lines:\n"
    "- { name: bay, port: /dev/a, protocol: fake, devices: [\n"
    "    { name: feeder, address: 1, unit: 36, profile: relay },\n"
    "    { name: spare, address: 2, unit: 5, profile: relay, enabled: false },\n"
    "    { name: hidden, address: 3, profile: relay }] }\n"
    "- { name: drive, port: /dev/b, protocol: modbus_rtu }\n"
    "- { name: text, port: /dev/c, protocol: modbus_ascii }\n";

std::string Table(const std::string& modbus) {
  const auto loaded = LoadModbus("modbus: { " + modbus + " }\n" + kLines);
  EXPECT_TRUE(loaded.ok()) << Shown(loaded.problems);
  std::ostringstream out;
  PrintRouteTable(loaded.config, out);
  return out.str();
}

TEST(RouteTable, DevicesThenRoutesThenTheGateway) {
  EXPECT_EQ(Table("routes: [{ units: 20, line: drive }, { units: 33-40, line: drive, remap: 1 }, "
                  "{ units: 40-42, line: text, deadline: 1s }, { units: 50-59, server: 10.0.0.9 }, "
                  "{ units: 36, line: text }]"),
            "\n"
            "Modbus units, in the order of matching\n"
            "  unit          goes to                                            deadline\n"
            "  5             device spare on line bay (cached, disabled)\n"
            "  36            device feeder on line bay (cached)\n"
            "  20            line drive, slave 20                               2.5s\n"
            "  33-35, 37-40  line drive, slaves 1-3, 5-8                        2.5s\n"
            "  41-42         line text, slaves 41-42                            1s\n"
            "  50-59         server 10.0.0.9:502, units 50-59                   2.5s\n"
            "  0, 255        the gateway itself: its status from register 9000\n"
            "  others        nothing: exception 0x0A\n");
}

TEST(RouteTable, WithoutRoutes) {
  EXPECT_EQ(Table("enabled: true"),
            "\n"
            "Modbus units, in the order of matching\n"
            "  unit    goes to\n"
            "  5       device spare on line bay (cached, disabled)\n"
            "  36      device feeder on line bay (cached)\n"
            "  0, 255  the gateway itself: its status from register 9000\n"
            "  others  nothing: exception 0x0A\n");
}

TEST(RouteTable, UnitZero) {
  EXPECT_THAT(Table("routes: [{ units: 0-2, line: drive }]"),
              HasSubstr("  0 (writes)  line drive, all slaves, never answered; but no listener has "
                        "broadcast: pass  2.5s\n"
                        "  1-2         line drive, slaves 1-2                                      "
                        "                 2.5s\n"
                        "  0, 255      the gateway itself"));
  EXPECT_THAT(Table("routes: [{ units: 0, line: drive, remap: 1 }]"),
              HasSubstr("  0       line drive, slave 1                                2.5s\n"
                        "  255     the gateway itself"));
  EXPECT_THAT(Table("routes: [{ units: 0, server: x }, { units: 255, line: text, remap: 1 }]"),
              HasSubstr("  0       server x:502, unit 0                         2.5s\n"
                        "  255     line text, slave 1                           2.5s\n"
                        "  others  "));
}

TEST(RouteTable, BroadcastsThatAListenerPasses) {
  const std::string routes = "routes: [{ units: 20, line: drive }, { units: 21, line: text }]";
  EXPECT_THAT(Table("listen: { broadcast: pass }, " + routes),
              HasSubstr("  0 (writes)  all slaves of lines drive, text, never answered\n"
                        "  0, 255      the gateway itself"));
  EXPECT_THAT(
      Table("listen: [\"127.0.0.1:1\", { at: \"127.0.0.1:2\", broadcast: pass }], " + routes),
      HasSubstr(
          "  0 (writes)  all slaves of lines drive, text, never answered (from 127.0.0.1:2)\n"));
}

TEST(RouteTable, WhatOthersGet) {
  EXPECT_THAT(Table("listen: [\"127.0.0.1:1\", /dev/m]"),
              HasSubstr("  others  nothing: exception 0x0A; no answer at /dev/m\n"));
  EXPECT_THAT(Table("listen: /dev/m"), HasSubstr("  others  nothing: no answer\n"));
}

std::string CheckUnits(const std::string& text) {
  const std::string path = ::testing::TempDir() + "baudgate_route_table.yaml";
  std::ofstream(path) << text;
  std::ostringstream out;
  std::ostringstream err;
  EXPECT_EQ(RunCheck(path, ModbusCatalog(), out, err, false), 0) << err.str();
  std::remove(path.c_str());
  return out.str();
}

TEST(CheckUnits, ListenersInFull) {
  const std::string out = CheckUnits(
      std::string(
          "modbus:\n"
          "  listen:\n"
          "  - { at: \"0.0.0.0:502\", permit: data, allow: [10.0.0.0/8, \"::1\"], priority: low, "
          "errors: silent, max_clients: 64, idle_timeout: 1min,\n"
          "      clients: [{ from: 10.0.0.7, priority: high }],\n"
          "      functions: [{ codes: [5, 6], priority: high }] }\n"
          "  - { at: \"127.0.0.1:2101\", framing: rtu, broadcast: pass }\n"
          "  - { at: /dev/m, serial: 9600 7E1, parity: software, permit: read }\n"
          "  routes: [{ units: 20, line: drive }]\n") +
      kLines);
  EXPECT_THAT(
      out,
      HasSubstr(
          "modbus 0.0.0.0:502, Modbus TCP, reading and writing data (functions 1-6, 15, 16), for "
          "10.0.0.0/8, ::1\n"
          "  priority   high for functions 5, 6; high for 10.0.0.7; low for others\n"
          "  errors     silent: nothing is answered instead of 0x06, 0x0A and 0x0B\n"
          "  broadcast  not passed on\n"
          "  clients    at most 64, closed after 1min without a request\n"
          "modbus 127.0.0.1:2101, Modbus RTU over TCP, reading and writing (all functions), for "
          "everybody who reaches it\n"
          "  priority   normal for all\n"
          "  errors     exceptions 0x06, 0x0A and 0x0B are answered\n"
          "  broadcast  passed to all slaves of every line with a route\n"
          "  clients    at most 256, closed after 5min without a request\n"
          "modbus /dev/m, 9600 7E1 (software parity), Modbus RTU, reading only (functions 1-4), "
          "for the master there\n"
          "  priority   normal for all\n"
          "  errors     silent: nothing is answered instead of 0x06, 0x0A and 0x0B\n"
          "  broadcast  not passed on\n"
          "dds "));
  EXPECT_THAT(out, HasSubstr("  20          line drive, slave 20 "));
}

TEST(CheckUnits, ModbusSwitchedOffHasNoTable) {
  const std::string out = CheckUnits(std::string("modbus: { enabled: false }\n") + kLines);
  EXPECT_THAT(out, HasSubstr("modbus off\n"));
  EXPECT_THAT(out, ::testing::Not(HasSubstr("order of matching")));
}

}  // namespace
}  // namespace baudgate::testing
