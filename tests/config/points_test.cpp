// Tests points: keys and values, overlapping registers, and additions to a profile's points.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
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

TEST(Points, AJumpSetsRecheckAndLimitsAreDecimals) {
  EXPECT_EQ(OnePoint("read: A1, type: int16, jump: 5").recheck, config::Recheck::jump);
  EXPECT_EQ(OnePoint("read: A1, type: int16, min: -1e2, max: 1E+2").writing.max, 100);
}

TEST(Points, EveryKeyIsRead) {
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

TEST(Points, BooleansAreBitsUnlessConfiguredOtherwise) {
  EXPECT_EQ(OnePoint("read: A1, type: bool").table, config::Table::bits);
  EXPECT_EQ(OnePoint("read: A1, type: bool, modbus: 1, table: coil").table, config::Table::bits);
  EXPECT_EQ(OnePoint("read: A1, type: bool, modbus: 1, table: input").table,
            config::Table::registers);
  EXPECT_EQ(OnePoint("read: A1, type: int16").table, config::Table::registers);
}

TEST(Points, ShowTheirValueWithPrecisionOrStates) {
  using std::int64_t;
  const auto shown = [](const std::string& keys, const Value& value) {
    return config::ShownText(OnePoint("read: A1, " + keys), value);
  };
  EXPECT_EQ(shown("type: float32, precision: 2", 0.526), "0.53");
  EXPECT_EQ(shown("type: float32, precision: 0", 12.5e6), "12500000");
  EXPECT_EQ(shown("type: float32", 0.5234567), "0.5235");
  EXPECT_EQ(shown("type: float32", 123456.7), "123457");
  EXPECT_EQ(shown("type: int32", int64_t{1834523}), "1834523");
  EXPECT_EQ(shown("type: int32", 1834523.0), "1834523") << "the history has doubles";
  EXPECT_EQ(shown("type: uint64", std::uint64_t{18446744073709551615U}), "18446744073709551615");
  EXPECT_EQ(shown("type: string(4)", std::string("v1.0")), "v1.0");
  EXPECT_EQ(shown("type: float32, precision: 2", Value()), "");
  const std::string states = "type: int16, states: { 0: off, 3: run, -1: test }";
  EXPECT_EQ(shown(states, int64_t{3}), "run");
  EXPECT_EQ(shown(states, int64_t{-1}), "test");
  EXPECT_EQ(shown(states, 3.0), "run");
  EXPECT_EQ(shown(states, int64_t{2}), "2") << "a value without a text is a number";
  EXPECT_EQ(shown("type: bool, states: { 0: open, 1: closed }", true), "closed");
  EXPECT_EQ(shown("type: bool, states: { 0: open }", true), "true");
}

TEST(Points, ShownKeysOfAConfigurationReplaceThoseOfTheProfile) {
  const auto points = PointsOf(
      "profile: relay, points: [{ name: current, precision: 3 }, "
      "{ name: extra, read: A9, type: int16, states: { 1: on } }]");
  EXPECT_EQ(points[0].precision, 3);
  ASSERT_EQ(points.back().states->size(), 1U);
  EXPECT_EQ(points.back().states->front().text, "on");
}

TEST(Points, TheTableIsTheNamedOneOrTheUsualOne) {
  EXPECT_EQ(config::TableName(OnePoint("read: A1, type: bool, modbus: 1")), "discrete");
  EXPECT_EQ(config::TableName(OnePoint("read: A1, type: bool, modbus: 1, table: coil")), "coil");
  EXPECT_EQ(config::TableName(OnePoint("read: A1, type: int16, modbus: 1")), "input");
  EXPECT_EQ(config::TableName(OnePoint("read: A1, type: int16, modbus: 1, table: holding")),
            "holding");
  EXPECT_EQ(config::TableName(OnePoint("read: A1, type: int16, modbus: 1, access: rw")), "holding");
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

TEST(Points, ABoolMaySimulateOneValue) {
  const Point point = OnePoint("read: A1, type: bool, simulate: true");
  EXPECT_EQ(point.simulate->low, 1);
  EXPECT_EQ(point.simulate->high, 1);
}

TEST(Points, InlineKeysReplaceOnlyTheEqualKeysOfTheProfile) {
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

TEST(Points, TypesMayHaveTheirIec61131Names) {
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

config::Loaded LoadRatios(const std::string& ratios) {
  return Load(
      "events: {}\nlines:\n- { name: l, port: /dev/l, protocol: fake, devices: [\n"
      "{ name: d, address: 1, ratios: " +
      ratios +
      ",\n"
      "points: [{ name: i, read: A1, type: float32, unit: xIn, scale: 0.5, offset: 1, deadband: "
      "0.01, jump: 0.1, modbus: 0, on_fault: -1, sentinels: { 999: 0x44 }, "
      "events: { on: above, value: 1.2, hysteresis: 0.1 } },"
      "{ name: u, read: A2, type: float32, unit: xUn, precision: 2 },"
      "{ name: t, read: A3, type: float32, unit: s },"
      "{ name: b, read: A4, type: bool, unit: xIn }] }] }\n");
}

TEST(Ratios, ScaleEveryNumberOfTheUnit) {
  const auto loaded = LoadRatios("{ xIn: 400 A, xUn: 10 kV }");
  ASSERT_EQ(Shown(loaded.problems), "");
  const auto& points = loaded.config.lines[0].devices[0].points;
  EXPECT_EQ(points[0].unit, "A");
  EXPECT_EQ(points[0].scale, 200);
  EXPECT_EQ(points[0].offset, 400);
  EXPECT_EQ(points[0].deadband, 4);
  EXPECT_EQ(points[0].jump, 40);
  EXPECT_EQ(points[0].on_fault.value, -400);
  EXPECT_EQ(points[0].events.at(0).value, 480);
  EXPECT_EQ(points[0].events.at(0).hysteresis, 40);
  EXPECT_EQ(points[0].sentinels[0].value, 999) << "of the raw value";
  EXPECT_EQ(points[1].unit, "kV");
  EXPECT_EQ(points[1].precision, 1) << "0.01 xUn are 0.1 kV";
  EXPECT_EQ(points[1].scale, 10);
  EXPECT_EQ(points[2].unit, "s");
  EXPECT_EQ(points[2].scale, 1);
  EXPECT_EQ(points[3].unit, "xIn") << "a bit has no size";
}

TEST(Ratios, ARatioIsNotAppliedToTheResultOfAnother) {
  const auto loaded = LoadRatios("{ xIn: 400 xUn, xUn: 10 kV }");
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(loaded.config.lines[0].devices[0].points[0].scale, 200);
}

using ::testing::HasSubstr;

/// Loads a device with points a (rw), b (rw, bool), r (read only) and t (rw, text). `keys` are
/// added to the device, `more` are added to point a.
config::Loaded LoadDevice(const std::string& keys, const std::string& more = "") {
  return Load(
      "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [\n"
      "{ name: d, address: 1" +
      keys + ",\npoints: [{ name: a, read: A1, type: float32, access: rw, modbus: 0, unit: A" +
      more +
      " },\n{ name: b, read: A2, type: bool, access: rw, modbus: 0 },\n"
      "{ name: r, read: A3, type: uint16 },\n"
      "{ name: t, read: A4, type: string(8), access: rw }] }] }\n");
}
const config::Point& PointOf(const config::Loaded& loaded, std::size_t index) {
  return loaded.config.lines.at(0).devices.at(0).points.at(index);
}
std::string Allowed(const config::Loaded& loaded) {
  std::string names;
  for (const config::Point& point : loaded.config.lines.at(0).devices.at(0).points) {
    if (point.writing.allowed) names += point.name;
  }
  return names;
}

TEST(WritePermit, IsOffUnlessTheDeviceAllowsIt) {
  EXPECT_EQ(Allowed(LoadDevice("")), "");
  EXPECT_EQ(Shown(LoadDevice("").problems), "");
  EXPECT_EQ(Allowed(LoadDevice(", write: deny")), "");
  EXPECT_EQ(Allowed(LoadDevice(", write: allow")), "abt") << "what can only be read stays so";
  EXPECT_EQ(Allowed(LoadDevice(", write: [b, a]")), "ab");
  EXPECT_EQ(Allowed(LoadDevice(", write: []")), "");
}

TEST(WritePermit, AProblemNamesOnlySomeOfManyPoints) {
  std::string points;
  for (int i = 0; i < 14; ++i) {
    points += (i == 0 ? "" : ",") + std::string("{ name: point_") + std::to_string(i) +
              ", read: A" + std::to_string(i) + ", type: uint16, access: rw }";
  }
  const auto loaded = Load(
      "lines: [{ name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1, write: "
      "[ponit_3], points: [" +
      points + "] }] }]\n");
  EXPECT_THAT(Shown(loaded.problems),
              HasSubstr("did you mean 'point_3'? points that can be written: point_0"));
  EXPECT_THAT(Shown(loaded.problems), HasSubstr("point_11 and 2 more\n"));
}

TEST(WriteLimits, AreRead) {
  const auto loaded = LoadDevice("", ", min: 0.5, max: 40, step: 0.05, decimals: 2");
  ASSERT_EQ(Shown(loaded.problems), "");
  const config::Writing& writing = PointOf(loaded, 0).writing;
  EXPECT_EQ(writing.min, 0.5);
  EXPECT_EQ(writing.max, 40);
  EXPECT_EQ(writing.step, 0.05);
  EXPECT_EQ(writing.decimals, 2);
  EXPECT_FALSE(writing.select);
  EXPECT_EQ(PointOf(loaded, 1).writing.min, std::nullopt);
}

TEST(WriteLimits, AreScaledByRatios) {
  const auto loaded = LoadDevice(", ratios: { A: 400 kA }", ", min: 0.5, max: 40, step: 0.05");
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(PointOf(loaded, 0).writing.min, 200);
  EXPECT_EQ(PointOf(loaded, 0).writing.max, 16000);
  EXPECT_EQ(PointOf(loaded, 0).writing.step, 20);
}

TEST(AllowWhen, FindsItsPointAnywhere) {
  const auto loaded = LoadDevice(", allow_when: { point: l.d.r, is: 7 }",
                                 ", allow_when: [{ point: l.d.r, is: 2 }, { point: l.d.t, is: "
                                 "local }]");
  ASSERT_EQ(Shown(loaded.problems), "");
  const auto& own = PointOf(loaded, 0).writing.allow_when;
  ASSERT_EQ(own.size(), 3U) << "its own and the device's";
  EXPECT_EQ(own[0].index, 2U);
  EXPECT_EQ(own[0].is, Value(std::int64_t{2}));
  EXPECT_EQ(own[1].is, Value(std::string("local")));
  EXPECT_EQ(own[2].is, Value(std::int64_t{7}));
  EXPECT_EQ(PointOf(loaded, 1).writing.allow_when.size(), 1U);
  EXPECT_TRUE(PointOf(loaded, 2).writing.allow_when.empty()) << "it is only read";
}

TEST(AllowWhen, CountsDevicesThroughAllLines) {
  const auto loaded = Load(
      "lines:\n"
      "- { name: one, port: /dev/1, protocol: fake, devices: [\n"
      "  { name: d, address: 1, points: [{ name: a, read: A1, type: bool, access: rw,\n"
      "    allow_when: { point: two.f.s, is: true } }] },\n"
      "  { name: e, address: 2, points: [{ name: a, read: A1, type: bool }] }] }\n"
      "- { name: two, port: /dev/2, protocol: fake, devices: [\n"
      "  { name: f, address: 1, points: [{ name: x, read: A1, type: bool },\n"
      "                                  { name: s, read: A2, type: bool }] }] }\n");
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(PointOf(loaded, 0).writing.allow_when.at(0).device, 2U);
  EXPECT_EQ(PointOf(loaded, 0).writing.allow_when.at(0).index, 1U);
}

TEST(AllowWhen, MayGuardOnlyOneValue) {
  const auto loaded = LoadDevice("", ", allow_when: { point: l.d.b, is: off, for: 12.5 }");
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(PointOf(loaded, 0).writing.allow_when.at(0).only, Value(12.5));
}

}  // namespace
}  // namespace baudgate::testing
