// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "protocols/common/clock.h"

namespace baudgate {
namespace {

using namespace std::chrono;  // NOLINT
using Fit = CivilZone::Fit;

CivilZone Zone(std::string_view text) { return CivilZone::Parse(text).value(); }

CivilZone::Civil At(year_month_day day, hours hour, minutes minute, seconds second = 0s) {
  return local_days(day) + hour + minute + second;
}
CivilZone::Utc Utc(year_month_day day, hours hour, minutes minute, seconds second = 0s) {
  return sys_days(day) + hour + minute + second;
}

constexpr auto kSpring = 2026y / March / 29;  // the last Sunday
constexpr auto kAutumn = 2026y / October / 25;

TEST(CivilZone, AnOffsetAlone) {
  EXPECT_EQ(Zone("+03:00").ToUtc(At(2026y / January / 1, 2h, 30min)).utc,
            Utc(2025y / December / 31, 23h, 30min));
  EXPECT_EQ(Zone("-03:30").ToUtc(At(2024y / February / 29, 23h, 0min)).utc,
            Utc(2024y / March / 1, 2h, 30min));
  EXPECT_EQ(Zone("+00:00").ToUtc(At(kAutumn, 2h, 30min)).fit, Fit::once);
}

TEST(CivilZone, SummerTimeBeginsAndEnds) {
  const CivilZone berlin = Zone("+01:00 eu");
  EXPECT_EQ(berlin.ToUtc(At(kSpring, 1h, 59min, 59s)).utc, Utc(kSpring, 0h, 59min, 59s));
  EXPECT_EQ(berlin.ToUtc(At(kSpring, 3h, 0min)).utc, Utc(kSpring, 1h, 0min));
  EXPECT_EQ(berlin.ToUtc(At(kAutumn, 1h, 59min, 59s)).utc,
            Utc(2026y / October / 24, 23h, 59min, 59s));
  EXPECT_EQ(berlin.ToUtc(At(kAutumn, 3h, 0min)).utc, Utc(kAutumn, 2h, 0min));
}

TEST(CivilZone, AnHourThatCameTwiceAndOneThatNeverCame) {
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

TEST(CivilZone, ThereAndBackThroughAYear) {
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

TEST(CivilZone, WhatIsNoZone) {
  for (const char* text : {"", "3", "+3", "+03", "03:00", "+03:60", "+15:00", "+03:00eu", "+0a:00",
                           "MSK", "+03:00 us", "+-3:00"}) {
    EXPECT_FALSE(CivilZone::Parse(text)) << text;
  }
}

}  // namespace
}  // namespace baudgate
