// Points: their keys, what they may say, registers that overlap, and profiles with inline
// additions.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::Point;

std::vector<Point> PointsOf(const std::string& device) {
  const auto loaded =
      Load("lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1, " +
           device + " }] }\n");
  EXPECT_EQ(Shown(loaded.problems), "");
  if (loaded.config.lines.empty() || loaded.config.lines[0].devices.empty()) return {};
  return loaded.config.lines[0].devices[0].points;
}

Point OnePoint(const std::string& keys) {
  const auto points = PointsOf("points: [{ name: p, " + keys + " }]");
  return points.size() == 1 ? points[0] : Point();
}

TEST(Points, JumpsAreReadAgainAndLimitsAreDecimals) {
  EXPECT_EQ(OnePoint("read: A1, type: int16, jump: 5").recheck, config::Recheck::jump);
  EXPECT_EQ(OnePoint("read: A1, type: int16, min: -1e2, max: 1E+2").writing.max, 100);
}

TEST(Points, EveryKey) {
  const Point point = OnePoint(
      "read: A1, write: A2, type: int32, unit: kW, access: rw, group: slow, modbus: 9100, "
      "table: holding, scale: 10, offset: -5, sentinels: { 999: sensor_failure, -1: 0x44 }, "
      "on_fault: -1, deadband: 0.5, jump: 3, recheck: always, simulate: [1, 2.5], description: "
      "power");
  EXPECT_EQ(point.read, "A1");
  EXPECT_EQ(point.write, "A2");
  EXPECT_EQ(point.type, config::Type::int32);
  EXPECT_EQ(point.unit, "kW");
  EXPECT_EQ(point.access, config::Access::read_write);
  EXPECT_EQ(point.group, config::Group::slow);
  EXPECT_EQ(point.modbus, 9100);
  EXPECT_EQ(point.scale, 10);
  EXPECT_EQ(point.offset, -5);
  ASSERT_EQ(point.sentinels.size(), 2U);
  EXPECT_EQ(point.sentinels[0].value, 999);
  EXPECT_EQ(point.sentinels[0].quality, Quality::bad_sensor_failure);
  EXPECT_EQ(point.sentinels[1].value, -1);
  EXPECT_EQ(point.sentinels[1].quality, Quality::uncertain_last_usable);
  EXPECT_EQ(point.on_fault.kind, config::OnFault::Kind::value);
  EXPECT_EQ(point.on_fault.value, -1);
  EXPECT_EQ(point.deadband, 0.5);
  EXPECT_EQ(point.jump, 3);
  EXPECT_EQ(point.recheck, config::Recheck::always);
  ASSERT_TRUE(point.simulate);
  EXPECT_EQ(point.simulate->low, 1);
  EXPECT_EQ(point.simulate->high, 2.5);
  EXPECT_EQ(*point.description, "power");
  EXPECT_EQ(point.mark.line, 2);
}

TEST(Points, BooleansStandInBitsUnlessToldOtherwise) {
  EXPECT_EQ(OnePoint("read: A1, type: bool").table, config::Table::bits);
  EXPECT_EQ(OnePoint("read: A1, type: bool, modbus: 1, table: coil").table, config::Table::bits);
  EXPECT_EQ(OnePoint("read: A1, type: bool, modbus: 1, table: input").table,
            config::Table::registers);
  EXPECT_EQ(OnePoint("read: A1, type: int16").table, config::Table::registers);
}

TEST(Points, StringsHaveALengthAndAFixedSimulation) {
  const Point point = OnePoint("read: A1, type: string(9), modbus: 0, simulate: 12");
  EXPECT_EQ(point.text_length, 9U);
  EXPECT_EQ(config::RegisterCount(point), 5U);
  EXPECT_EQ(point.simulate->text, "12");
}

TEST(Points, WriteOnlyNeedsNoRead) {
  EXPECT_EQ(OnePoint("write: A1, access: w, type: int16").read, "");
}

TEST(Points, SimulateOneValueOfABool) {
  const Point point = OnePoint("read: A1, type: bool, simulate: true");
  EXPECT_EQ(point.simulate->low, 1);
  EXPECT_EQ(point.simulate->high, 1);
}

TEST(Points, InlineKeysReplaceThoseOfTheProfileAndOthersStay) {
  const auto points = PointsOf(
      "profile: relay, points: [{ name: current, modbus: 20, deadband: 0.1 }, "
      "{ name: extra, read: A9, type: int16, modbus: 0 }]");
  ASSERT_EQ(points.size(), 4U);
  EXPECT_EQ(points[0].name, "current");
  EXPECT_EQ(points[0].modbus, 20) << "replaced";
  EXPECT_EQ(points[0].deadband, 0.1) << "added";
  EXPECT_EQ(*points[0].description, "current") << "kept";
  EXPECT_EQ(*points[0].mark.file, "t.yaml");
  EXPECT_EQ(*points[1].mark.file, "tests/config/profiles/fake/relay.yaml");
  EXPECT_EQ(points[3].name, "extra") << "at the end, so that indices of the profile stay";
}

TEST(Points, TypesAreCalledAsInIec61131) {
  const auto loaded = Load(
      "lines:\n- name: l\n  port: /dev/l\n  protocol: fake\n  devices:\n"
      "  - name: d\n    address: 1\n    points:\n"
      "    - { name: _a, read: A1, type: LREAL, poll: 5ms }\n"
      "    - { name: b, read: A1, type: USINT, poll: 250ms }\n"
      "    - { name: c, read: A1, type: TOD, poll: 5ms }\n"
      "    - { name: d, read: A1, type: DATE_AND_TIME, unit: h, group: slow }\n"
      "    - { name: e, read: A1, type: \"STRING[7]\" }\n");
  ASSERT_TRUE(loaded.ok()) << Shown(loaded.problems);
  const config::Device& device = loaded.config.lines.at(0).devices.at(0);
  std::string all;
  for (const config::Point& point : device.points) {
    all += point.name + " " + std::string(Name(point.type)) + " " + IecName(point) + " " +
           point.unit + " " + PeriodText(point) + " " +
           FormatDuration(PeriodOf(device, point.group)) + "\n";
  }
  EXPECT_EQ(all,
            "_a float64 LREAL  5ms 5ms\n"
            "b uint8 USINT  250ms 250ms\n"
            "c uint32 TOD ms 5ms 5ms\n"
            "d uint32 DT h slow 1min\n"
            "e string STRING[7]  fast 1s\n");
  EXPECT_EQ(device.intervals.size(), 2U);
  EXPECT_EQ(RangeOf(device.points[1]).highest, 255U);
  EXPECT_EQ(RangeOf(device.points[2]).highest, 86'399'999U);
}

}  // namespace
}  // namespace baudgate::testing
