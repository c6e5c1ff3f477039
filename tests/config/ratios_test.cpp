// `ratios` of a device: what its units are at this site.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

config::Loaded LoadRatios(const std::string& ratios) {
  return Load(
      "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [\n"
      "{ name: d, address: 1, ratios: " +
      ratios +
      ",\n"
      "points: [{ name: i, read: A1, type: float32, unit: xIn, scale: 0.5, offset: 1, deadband: "
      "0.01, jump: 0.1, modbus: 0, on_fault: -1, sentinels: { 999: 0x44 } },"
      "{ name: u, read: A2, type: float32, unit: xUn },"
      "{ name: t, read: A3, type: float32, unit: s },"
      "{ name: b, read: A4, type: bool, unit: xIn }] }] }\n");
}

TEST(Ratios, ChangeEveryNumberOfTheUnitAlike) {
  const auto loaded = LoadRatios("{ xIn: 400 A, xUn: 10 kV }");
  ASSERT_EQ(Shown(loaded.problems), "");
  const auto& points = loaded.config.lines[0].devices[0].points;
  EXPECT_EQ(points[0].unit, "A");
  EXPECT_EQ(points[0].scale, 200);
  EXPECT_EQ(points[0].offset, 400);
  EXPECT_EQ(points[0].deadband, 4);
  EXPECT_EQ(points[0].jump, 40);
  EXPECT_EQ(points[0].on_fault.value, -400);
  EXPECT_EQ(points[0].sentinels[0].value, 999) << "of the raw value";
  EXPECT_EQ(points[1].unit, "kV");
  EXPECT_EQ(points[1].scale, 10);
  EXPECT_EQ(points[2].unit, "s");
  EXPECT_EQ(points[2].scale, 1);
  EXPECT_EQ(points[3].unit, "xIn") << "a bit has no size";
}

TEST(Ratios, OneDoesNotMeetTheResultOfAnother) {
  const auto loaded = LoadRatios("{ xIn: 400 xUn, xUn: 10 kV }");
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(loaded.config.lines[0].devices[0].points[0].scale, 200);
}

}  // namespace
}  // namespace baudgate::testing
