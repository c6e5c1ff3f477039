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

TEST(WritePermit, NamesWhatIsWrong) {
  const auto problem = [](const std::string& keys) { return Shown(LoadDevice(keys).problems); };
  EXPECT_EQ(problem(", write: yes"),
            "t.yaml:3:31: error: write: 'yes' is unknown; allowed: deny, allow\n");
  EXPECT_EQ(problem(", write: [aa]"),
            "t.yaml:3:32: error: write: 'aa' is no point of 'd'; did you mean 'a'? can be written: "
            "a, b, t\n");
  EXPECT_THAT(problem(", write: [r]"), HasSubstr("'r' can only be read of 'd'"));
  EXPECT_EQ(problem(", write: [allow]"),
            "t.yaml:3:32: error: write: 'allow' is no point of 'd'; for all of its points write "
            "'write: allow', without brackets\n");
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

TEST(WriteLimits, SayWhatIsWrong) {
  const auto problem = [](const std::string& more) { return Shown(LoadDevice("", more).problems); };
  EXPECT_THAT(problem(", min: 2, max: 1"), HasSubstr("min: 2 is above max (1)"));
  EXPECT_THAT(problem(", step: 0"), HasSubstr("step: must be above 0"));
  EXPECT_THAT(problem(", decimals: 10"), HasSubstr("decimals"));
  EXPECT_THAT(problem(", type: bool, table: holding, max: 1"), HasSubstr("error"));
  EXPECT_THAT(problem(", select_time: 5s"), HasSubstr("select_time: needs 'select: yes'"));
  EXPECT_THAT(problem(", select: true, select_time: 11min"), HasSubstr("select_time"));
}

TEST(Select, LiesWhereItsRegisterExists) {
  EXPECT_EQ(Shown(LoadDevice("", ", select: true, select_time: 5s").problems), "");
  const auto at = [](int address) {
    return Shown(Load("lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [ { name: d, "
                      "address: 1, points: [{ name: a, read: A1, type: bool, access: w, select: "
                      "true, modbus: " +
                      std::to_string(address) + " }] }] }\n")
                     .problems);
  };
  EXPECT_EQ(at(5535), "");
  EXPECT_THAT(at(5536), HasSubstr("give it one below 5536"));
}

TEST(Select, OneRegisterSelectsOnePoint) {
  const std::string problems =
      Shown(Load("lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [ { name: d, "
                 "address: 1, points: [{ name: a, read: A1, type: int16, access: rw, select: true, "
                 "modbus: 7 }, { name: b, read: A2, type: bool, access: rw, select: true, modbus: "
                 "7 }] }] }\n")
                .problems);
  EXPECT_THAT(problems, HasSubstr("'b' and 'a' would be selected by one register, 60000 + 7"));
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
  EXPECT_THAT(Shown(LoadDevice("", ", allow_when: { point: l.d.b, is: off, for: on }").problems),
              HasSubstr("for: 'a' is float32, and never 'on'"));
  EXPECT_THAT(Shown(LoadDevice("", ", allow_when: { point: l.d.a, is: 1 }").problems),
              HasSubstr("'l.d.a' guards itself"));
}

TEST(AllowWhen, SaysWhatIsWrongOnceAndWhere) {
  const auto problem = [](const std::string& keys) {
    return Shown(LoadDevice(", allow_when: " + keys).problems);
  };
  EXPECT_EQ(problem("{ point: l.d.c, is: true }"),
            "t.yaml:3:36: error: allow_when: 'l.d.c' names no point; did you mean 'l.d.a'? write "
            "LINE.DEVICE.POINT\n");
  EXPECT_THAT(problem("{ point: k.d.tt, is: true }"), HasSubstr("did you mean 'l.d.t'?"));
  EXPECT_THAT(problem("{ point: l.d.something, is: true }"), Not(HasSubstr("did you mean")));
  for (const char* name : {"l", "l.d", "x.d.b", "l.x.b", "l.d.b.c", ".."}) {
    EXPECT_THAT(problem("{ point: " + std::string(name) + ", is: true }"),
                HasSubstr("names no point"))
        << name;
  }
  EXPECT_THAT(problem("{ point: l.d.b, is: 2 }"), HasSubstr("is bool, and never '2'"));
  EXPECT_THAT(problem("{ point: l.d.r, is: on }"), HasSubstr("is uint16, and never 'on'"));
  EXPECT_THAT(problem("{ point: l.d.r, is: 70000 }"), HasSubstr("and never '70000'"));
  EXPECT_EQ(problem("{ point: l.d.b, is: off }"), "");
  EXPECT_THAT(problem("{ point: l.d.b }"), HasSubstr("needs 'is'"));
  EXPECT_THAT(problem("l.d.b"), HasSubstr("allow_when"));
  EXPECT_THAT(Shown(LoadDevice("", "").problems), "");
}

}  // namespace
}  // namespace baudgate::testing
