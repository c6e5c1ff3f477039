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

/// Each does something where it stands, or is refused by its name.
TEST(Points, NoKeyDoesNothing) {
  const std::pair<const char*, const char*> cases[] = {
      {"type: int16, step: 2", "step: 'p' can only be read"},
      {"type: int16, decimals: 0", "decimals: 'p' can only be read"},
      {"type: int16, select: yes", "select: 'p' can only be read"},
      {"type: int16, access: r, write: A2", "write: 'p' can only be read"},
      {"type: int16, allow_when: { point: l.d.other, is: 1 }", "allow_when: 'p' can only be read"},
      {"type: int16, max: other", "max: 'p' can only be read: its limit is a number"},
      {"type: int16, access: rw, max: other_one",
       "max: 'other_one' is neither a number nor a point"},
      {"type: int16, access: rw, max: p", "max: 'p' cannot be its own limit"},
      {"type: int16, access: rw, unit: V, max: other", "max: 'other' is in '', and 'p' in 'V'"},
      {"type: int16, access: rw, max: text", "max: 'text' is string, no number"},
      {"type: int16, access: rw, max: pulse", "max: 'pulse' cannot be read"},
      {"type: uint16, max: -1", "max: -1 is below all that uint16 can hold"},
      {"type: int8, min: 128", "min: 128 is above all that int8 can hold"},
      {"type: bool, deadband: 1", "deadband: only numbers have one"},
      {"type: string(8), deadband: 1", "deadband: only numbers have one"},
      {"type: int16, jump: 5, recheck: off", "jump: with recheck: off each reading counts"},
      {"type: int16, access: w, jump: 5", "jump: 'p' can only be written"},
      {"type: int16, access: w, poll: 1s", "poll: 'p' can only be written"},
      {"type: int16, on_fault: 0", "on_fault: it is what the registers of a point show"},
      {"type: bool, table: coil", "table: 'p' stands in no table"},
  };
  for (const auto& [keys, problem] : cases) {
    const auto loaded = Load(
        "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1, "
        "points: [{ name: p, read: A1, " +
        std::string(keys) +
        " }, { name: other, read: A2, type: int16 }, { name: text, read: A3, type: string(8) }, "
        "{ name: pulse, read: A4, type: int16, access: w }] }] }\n");
    ASSERT_EQ(loaded.problems.size(), 1U) << keys << Shown(loaded.problems);
    EXPECT_FALSE(loaded.problems[0].warning) << keys;
    EXPECT_TRUE(loaded.problems[0].message.starts_with(problem)) << loaded.problems[0].message;
  }
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

TEST(Points, OneSentenceEach) {
  const Case kCases[] = {
      {"read: A1, type: int16", "11: error: point needs 'name'; for example name: current_l1"},
      {"name: a-b, read: A1, type: int16",
       "19: error: name: 'a-b' is no point name; use letters, digits and single '_' before or "
       "between them, no digit first"},
      {"name: 1a, read: A1, type: int16",
       "19: error: name: '1a' is no point name; use letters, digits and single '_' before or "
       "between them, no digit first"},
      {"name: p, read: A1", "11: error: point 'p' needs 'type'; for example type: float32"},
      {"name: p, read: A1, type: string",
       "38: error: type: 'string' needs its length in bytes: string(16)"},
      {"name: p, read: A1, type: string(200)",
       "38: error: type: 'string(200)' has no usable length; allowed: string(1)…string(128)"},
      {"name: p, read: Z, type: int16",
       "28: error: point 'p': read 'Z' is not understood; write A and a number"},
      {"name: p, type: int16",
       "11: error: point 'p' needs 'read'; for example read: \"…\" (the protocol's own address)"},
      {"name: p, read: A1, type: int16, acces: rw",
       "45: error: unknown key 'acces' in point 'p'; did you mean 'access'? allowed: name, type, "
       "access, write, read, modbus, table, unit, group, poll, scale, offset, deadband, jump, "
       "recheck, "
       "description, "
       "sentinels, on_fault, simulate, min, max, step, decimals, select, select_time, allow_when, "
       "events"},
      {"name: p, read: A1, type: int16, write: A2",
       "52: error: write: 'p' can only be read, and this key is for points that are written; add "
       "access: rw or remove 'write'"},
      {"name: p, read: A1, type: int16, modbus: 9000",
       "53: error: modbus: register 9000 of 'p' is reserved; points live at 0…8999 and "
       "9100…19999"},
      {"name: p, read: A1, type: float32, modbus: 8999",
       "55: error: modbus: register 8999…9000 of 'p' is reserved; points live at 0…8999 and "
       "9100…19999"},
      {"name: p, read: A1, type: int16, modbus: 70000",
       "53: error: modbus: '70000' is out of range; allowed: 0…65535"},
      {"name: p, read: A1, type: int16, table: coil",
       "52: error: table: only bool points fit a bit table, and 'p' is int16; write table: input"},
      {"name: p, read: A1, type: int16, scale: 0",
       "52: error: scale: 0 would make every value the same"},
      {"name: p, read: A1, type: int16, scale: 0.01",
       "52: warning: scale: 'p' is int16, so its decimals are rounded away; write type: float32, "
       "and what the device holds in 'read'"},
      {"name: p, read: A1, type: int16, offset: 0.5",
       "53: warning: offset: 'p' is int16, so its decimals are rounded away; write type: float32, "
       "and what the device holds in 'read'"},
      {"name: p, read: A1, type: float32, scale: 1e-",
       "54: error: scale: '1e-' is not a decimal number; write for example 0.001"},
      {"name: p, read: A1, type: bool, scale: 2",
       "51: error: scale: only numbers can be scaled, and 'p' is bool"},
      {"name: p, read: A1, type: int16, jump: -1", "51: error: jump: must not be negative"},
      {"name: p, read: A1, type: bool, jump: 1",
       "50: error: jump: only numbers jump, and 'p' is bool, of which each change counts"},
      {"name: p, read: A1, type: int16, deadband: -1", "55: error: deadband: must not be negative"},
      {"name: p, read: A1, type: int16, on_fault: nan",
       "55: error: on_fault: nan needs a float type, and 'p' is int16; write hold or a number"},
      {"name: p, read: A1, type: uint16, on_fault: -1",
       "56: error: on_fault: -1 does not fit type uint16"},
      {"name: p, read: A1, type: int64, on_fault: 9223372036854775808",
       "55: error: on_fault: 9223372036854775808 does not fit type int64"},
      {"name: p, read: A1, type: int16, on_fault: bad",
       "55: error: on_fault: 'bad' is unknown; allowed: nan, hold or a number"},
      {"name: p, read: A1, type: int16, sentinels: { high: sensor_failure }",
       "58: error: sentinels: 'high' is not a number; write { 999: sensor_failure } or { 0xFFFF: "
       "sensor_failure }"},
      {"name: p, read: A1, type: int16, sentinels: { 1: good }",
       "61: error: sentinels: 1: 'good' is unknown; allowed: sensor_failure, device_failure, "
       "configuration, not_connected, out_of_service, last_usable, sub_normal, uncertain"},
      {"name: p, read: A1, type: int16, sentinels: { 1: 0xC0 }",
       "61: error: sentinels: 1: '0xC0' is unknown; allowed: sensor_failure, device_failure, "
       "configuration, not_connected, out_of_service, last_usable, sub_normal, uncertain"},
      {"name: p, read: A1, type: int16, sentinels: { 1: uncertain, 1.0: uncertain }",
       "72: error: sentinels: 1.0 stands twice"},
      {"name: p, read: A1, type: int16, simulate: [2, 1]",
       "55: error: simulate: the low end is above the high end; write [low, high]"},
      {"name: p, read: A1, type: int16, simulate: [2]",
       "55: error: simulate: a range has two ends; write [low, high]"},
      {"name: p, read: A1, type: int16, simulate: high",
       "55: error: simulate: 'high' is not a decimal number; write for example 0.001"},
      {"name: p, read: A1, type: string(2), simulate: abc",
       "59: error: simulate: the text is longer than string(2)"},
      {"name: p, read: A1, type: int16, unit: aaaaaaaaaaaaaaaaa",
       "51: error: unit: 'aaaaaaaaaaaaaaaaa' is too long; at most 16 bytes"},
      {"name: p, read: A1, type: int16, unit: \"\\e[2J\"",
       "51: error: unit: control characters are not allowed"},
  };
  for (const Case& one : kCases) {
    const std::string problems = ProblemsOfPoint(one.keys);
    const std::string rest = problems.starts_with("t.yaml:6:5: warning")
                                 ? problems.substr(problems.find('\n') + 1)
                                 : problems;
    EXPECT_EQ(rest, "t.yaml:8:" + std::string(one.problem) + "\n") << one.keys;
  }
}

TEST(Points, OverlapNamesBothPointsAndPlaces) {
  const auto loaded = Load(
      "lines:\n- name: l\n  port: /dev/l\n  protocol: fake\n  devices:\n"
      "  - name: d\n    address: 1\n    points:\n"
      "    - { name: a, read: A1, type: float32, modbus: 10 }\n"
      "    - { name: b, read: A2, type: int16, modbus: 12 }\n"
      "    - { name: c, read: A3, type: float32, modbus: 11 }\n"
      "    - { name: e, read: A4, type: bool, modbus: 10 }\n"
      "    - { name: f, read: A5, type: bool, modbus: 10, table: input }\n"
      "    - { name: g, read: A6, type: float64, modbus: 7 }\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:11:51: error: modbus: register 11…12 of 'c' overlaps 10…11 of 'a' "
            "(t.yaml:9:51)\n"
            "t.yaml:13:48: error: modbus: register 10 of 'f' overlaps 10…11 of 'a' "
            "(t.yaml:9:51)\n"
            "t.yaml:14:51: error: modbus: register 7…10 of 'g' overlaps 10…11 of 'a' "
            "(t.yaml:9:51)\n");
}

TEST(Points, AMisspeltPointOfTheProfileIsNamed) {
  const auto loaded = Load(
      "lines:\n- name: l\n  port: /dev/l\n  protocol: fake\n  devices:\n"
      "  - name: d\n    address: 1\n    profile: relay\n    points:\n"
      "    - { name: curent, unit: kA }\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:10:7: error: point 'curent' is not in the profile; did you mean 'current'? "
            "a new point needs 'type' and 'read'\n");
}

TEST(Points, NamesAreUniqueWhateverTheirCase) {
  const auto loaded = Load(
      "lines:\n- name: l\n  port: /dev/l\n  protocol: fake\n  devices:\n"
      "  - name: d\n    address: 1\n    profile: relay\n    points:\n"
      "    - { name: x, read: A1, type: int16 }\n"
      "    - { name: X, read: A1, type: int16 }\n"
      "    - { name: Current, unit: kA }\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:11:15: error: point 'X' stands twice; first in line 10\n"
            "t.yaml:12:7: error: point 'Current' differs only in case from 'current' of the "
            "profile; write it the same way\n");
}

}  // namespace
}  // namespace baudgate::testing
