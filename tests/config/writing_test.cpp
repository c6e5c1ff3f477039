// What may be written: keys of points and devices, and what is wrong with them.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A device with points a (rw), b (rw, bool), r (read only) and t (rw, text); `keys` of the device,
/// `more` of point a.
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

TEST(WritePermit, IsOffUntilTheDeviceSaysSo) {
  EXPECT_EQ(Allowed(LoadDevice("")), "");
  EXPECT_EQ(Shown(LoadDevice("").problems), "");
  EXPECT_EQ(Allowed(LoadDevice(", write: deny")), "");
  EXPECT_EQ(Allowed(LoadDevice(", write: allow")), "abt") << "what can only be read stays so";
  EXPECT_EQ(Allowed(LoadDevice(", write: [b, a]")), "ab");
  EXPECT_EQ(Allowed(LoadDevice(", write: []")), "");
}

TEST(WritePermit, NamesSomeOfManyPoints) {
  std::string points;
  for (int i = 0; i < 14; ++i) {
    points += (i == 0 ? "" : ",") + std::string("{ name: point_") + std::to_string(i) +
              ", read: A" + std::to_string(i) + ", type: uint16, access: rw }";
  }
  const auto loaded = Load(
      "lines: [{ name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1, write: "
      "[ponit_3], points: [" +
      points + "] }] }]\n");
  EXPECT_THAT(Shown(loaded.problems), HasSubstr("did you mean 'point_3'? can be written: point_0"));
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

TEST(WriteLimits, FollowRatios) {
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

TEST(AllowWhen, MayGuardOneValueAlone) {
  const auto loaded = LoadDevice("", ", allow_when: { point: l.d.b, is: off, for: 12.5 }");
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(PointOf(loaded, 0).writing.allow_when.at(0).only, Value(12.5));
}

}  // namespace
}  // namespace baudgate::testing
