// Tests the points of a simulated device, civil time zones, and the cuts that frame rules return.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/twin_points.h"

#include <gtest/gtest.h>

#include <map>

#include "protocols/common/clock.h"
#include "protocols/common/frame_cuts.h"

namespace baudgate::protocols {
namespace {

class Values : public TwinValues {
 public:
  Value Get(std::size_t point, Instant) const override { return values.at(point); }
  void Set(std::size_t point, const Value& value) override { values[point] = value; }

  std::map<std::size_t, Value> values;
};

config::Point MakePoint(const char* read, const char* write, config::Access access) {
  config::Point point;
  point.read = read;
  point.write = write;
  point.access = access;
  return point;
}

Result<std::string> Parse(const std::string& text) {
  if (text == "bad") return Error{"bad"};
  return text;
}

TEST(TwinPoints, AreFoundByAccess) {
  config::Device device;
  device.points = {MakePoint("bad", "", config::Access::read),
                   MakePoint("r", "w", config::Access::read),
                   MakePoint("both", "both", config::Access::read_write),
                   MakePoint("x", "w", config::Access::write)};
  Values values;
  const TwinPoints<std::string> points(
      device, values, [](const config::Point& point) { return Parse(point.read); },
      [](const config::Point& point) { return Parse(point.write); });
  const auto index = [](const auto* one) { return one == nullptr ? 99 : one->index; };
  const auto is = [](const char* wanted) {
    return [wanted](const std::string& text) { return text == wanted; };
  };
  EXPECT_EQ(points.all().size(), 4U);
  EXPECT_EQ(index(points.Find(is("bad"))), 99U);
  EXPECT_EQ(index(points.Find(is("r"))), 1U);
  EXPECT_EQ(index(points.Find(is("x"))), 99U) << "write-only";
  EXPECT_EQ(index(points.FindWritable(is("w"))), 3U) << "the first is read-only";
  EXPECT_EQ(index(points.FindWritable(is("both"))), 2U);
}

TEST(TwinPoints, ReadAndWriteTheirOwnValue) {
  config::Device device;
  device.points = {MakePoint("a", "a", config::Access::read_write),
                   MakePoint("b", "b", config::Access::read_write)};
  Values values;
  values.values = {{0, 1.5}, {1, 2.5}};
  const auto parse = [](const config::Point& point) { return Parse(point.read); };
  TwinPoints<std::string> points(device, values, parse, parse);
  const auto* one = points.Find([](const std::string& text) { return text == "b"; });
  ASSERT_NE(one, nullptr);
  EXPECT_EQ(points.Get(*one, {}), Value(2.5));
  points.Set(*one, 7.0);
  EXPECT_EQ(values.values[1], Value(7.0));
  EXPECT_EQ(values.values[0], Value(1.5));
}

using namespace std::chrono;  // NOLINT
using Fit = CivilZone::Fit;

CivilZone Zone(std::string_view text) { return CivilZone::Parse(text).value(); }

CivilZone::Civil At(year_month_day day, hours hour, minutes minute, seconds second = 0s) {
  return local_days(day) + hour + minute + second;
}
CivilZone::Utc Utc(year_month_day day, hours hour, minutes minute, seconds second = 0s) {
  return sys_days(day) + hour + minute + second;
}

constexpr auto kSpring = 2026y / March / 29;  // the last Sunday, on which summer time begins
constexpr auto kAutumn = 2026y / October / 25;

TEST(CivilZone, ConvertsAFixedOffset) {
  EXPECT_EQ(Zone("+03:00").ToUtc(At(2026y / January / 1, 2h, 30min)).utc,
            Utc(2025y / December / 31, 23h, 30min));
  EXPECT_EQ(Zone("-03:30").ToUtc(At(2024y / February / 29, 23h, 0min)).utc,
            Utc(2024y / March / 1, 2h, 30min));
  EXPECT_EQ(Zone("+00:00").ToUtc(At(kAutumn, 2h, 30min)).fit, Fit::once);
}

TEST(CivilZone, ConvertsBeginAndEndOfSummerTime) {
  const CivilZone berlin = Zone("+01:00 eu");
  EXPECT_EQ(berlin.ToUtc(At(kSpring, 1h, 59min, 59s)).utc, Utc(kSpring, 0h, 59min, 59s));
  EXPECT_EQ(berlin.ToUtc(At(kSpring, 3h, 0min)).utc, Utc(kSpring, 1h, 0min));
  EXPECT_EQ(berlin.ToUtc(At(kAutumn, 1h, 59min, 59s)).utc,
            Utc(2026y / October / 24, 23h, 59min, 59s));
  EXPECT_EQ(berlin.ToUtc(At(kAutumn, 3h, 0min)).utc, Utc(kAutumn, 2h, 0min));
}

TEST(CivilZone, DetectsRepeatedAndMissingHours) {
  const CivilZone berlin = Zone("+01:00 eu");
  const auto twice = berlin.ToUtc(At(kAutumn, 2h, 30min));
  EXPECT_EQ(twice.fit, Fit::twice);
  EXPECT_EQ(twice.utc, Utc(kAutumn, 1h, 30min)) << "the second";
  EXPECT_EQ(berlin.ToUtc(At(kAutumn, 2h, 0min)).fit, Fit::twice);
  EXPECT_EQ(berlin.ToUtc(At(kAutumn, 2h, 59min, 59s)).fit, Fit::twice);
  const auto never = berlin.ToUtc(At(kSpring, 2h, 30min));
  EXPECT_EQ(never.fit, Fit::never);
  EXPECT_EQ(never.utc, Utc(kSpring, 1h, 30min));
}

TEST(CivilZone, ConvertsBothWaysThroughAYear) {
  for (const char* text : {"+00:00", "+03:00", "+01:00 eu", "-01:00 eu", "+14:00"}) {
    const CivilZone zone = Zone(text);
    for (auto utc = Utc(2026y / January / 1, 0h, 0min); utc < Utc(2027y / January / 2, 0h, 0min);
         utc += 11min + 7s) {
      const auto back = zone.ToUtc(zone.ToCivil(utc));
      ASSERT_NE(back.fit, Fit::never) << text;
      ASSERT_EQ(back.utc - utc, back.fit == Fit::twice && back.utc != utc ? 1h : 0h) << text;
    }
  }
}

TEST(CivilZone, RefusesInvalidZones) {
  for (const char* text : {"", "3", "+3", "+03", "03:00", "+03:60", "+15:00", "+03:00eu", "+0a:00",
                           "MSK", "+03:00 us", "+-3:00"}) {
    EXPECT_FALSE(CivilZone::Parse(text)) << text;
  }
}

TEST(FrameCuts, NoiseIsDroppedInRunsOfOneKind) {
  struct Case {
    const char* what;
    std::string_view held;
    std::size_t size;
    Outcome blame;
  };
  using namespace std::string_view_literals;
  for (const Case& c : {Case{"up to a start", "abc>1"sv, 3, Outcome::partial},
                        Case{"all there is", "abc"sv, 3, Outcome::partial},
                        Case{"harmless bytes first", "\0\xFF\0ab>"sv, 3, Outcome::none},
                        Case{"up to harmless bytes", "ab\0\0>"sv, 2, Outcome::partial},
                        Case{"what the protocol calls harmless", "\n\n>"sv, 2, Outcome::none}}) {
    const Cut got = cut::SkipNoise(ToBytes(c.held), "<>", "\n");
    EXPECT_EQ(got.kind, Cut::Kind::discard) << c.what;
    EXPECT_EQ(got.size, c.size) << c.what;
    EXPECT_EQ(got.blame, c.blame) << c.what;
  }
}

TEST(FrameCuts, AByteIsDamageUnlessItIsDriverNoise) {
  EXPECT_EQ(cut::Slide(Bytes{0x00, 1}, "").blame, Outcome::none);
  EXPECT_EQ(cut::Slide(Bytes{0xFF, 1}, "").blame, Outcome::none);
  EXPECT_EQ(cut::Slide(Bytes{0x0A, 1}, "").blame, Outcome::partial);
  EXPECT_EQ(cut::Slide(Bytes{0x0A, 1}, "").size, 1U);
}

TEST(FrameCuts, AnIncompleteFrameWaitsUntilTheLineIsSilent) {
  EXPECT_EQ(cut::Wait(false).kind, Cut::Kind::need_more);
  const Cut over = cut::Wait(true, 7);
  EXPECT_EQ(over.kind, Cut::Kind::discard);
  EXPECT_EQ(over.size, 7U);
  EXPECT_EQ(over.blame, Outcome::partial);
}

}  // namespace
}  // namespace baudgate::protocols
