// What is left of a history in so many pixels.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/history/history_view.h"
#include "tests/gateway/outputs/web/fakes.h"

namespace baudgate::history {
namespace {

using web::FakeHistory;
using web::kDayBegin;

constexpr const char* kPoint = "bay-1.feeder-1.current";

TEST(Chart, ShortTimesAreOfEveryValue) {
  const FakeHistory source;
  const auto chart = ReadChart(source, {kPoint, kDayBegin, kDayBegin + 10 * kMinute, 60});
  ASSERT_TRUE(chart);
  EXPECT_TRUE(chart->known);
  EXPECT_EQ(chart->step, 10 * kSecond);
  ASSERT_EQ(chart->rows.size(), 30U) << "what is bad is a hole";
  const Trend& second = chart->rows[1];
  EXPECT_EQ(second.begin, kDayBegin + 10 * kSecond);
  EXPECT_EQ(second.min, 20);
  EXPECT_EQ(second.max, 29);
  EXPECT_DOUBLE_EQ(second.mean, 24.5);
  EXPECT_EQ(second.good, 10 * kSecond);
  EXPECT_EQ(chart->rows[3].begin, kDayBegin + 60 * kSecond);
}

TEST(Chart, APieceBeginsWithTheValueFromBefore) {
  const FakeHistory source;
  const auto chart = ReadChart(source, {kPoint, kDayBegin + 5500, kDayBegin + 6500, 1200});
  ASSERT_TRUE(chart);
  EXPECT_EQ(chart->step, kSecond);
  ASSERT_EQ(chart->rows.size(), 2U);
  EXPECT_EQ(chart->rows[0].begin, kDayBegin + 5000);
  EXPECT_EQ(chart->rows[0].mean, 15);
  EXPECT_EQ(chart->rows[1].good, 500);
}

TEST(Chart, LongTimesAreOfMinutesAndHours) {
  const FakeHistory source;
  const auto year = ReadChart(source, {kPoint, kDayBegin, kDayBegin + 365 * kDay, 1200});
  ASSERT_TRUE(year);
  EXPECT_EQ(year->step, 438 * kMinute);
  EXPECT_EQ(source.every, year->step);
  EXPECT_EQ(year->rows.size(), 1U);
  const auto day = ReadChart(source, {kPoint, kDayBegin, kDayBegin + kDay, 1200});
  EXPECT_EQ(day->step, 2 * kMinute);
}

TEST(Chart, ThereIsAlwaysAStep) {
  const FakeHistory source;
  for (const Millis span : {Millis{1}, kSecond, kMinute, kHour, 20 * 366 * kDay}) {
    for (const std::int64_t pixels : {1, 7, 4096}) {
      const auto chart = ReadChart(source, {"a.b.c", kDayBegin, kDayBegin + span, pixels});
      ASSERT_TRUE(chart);
      EXPECT_GE(chart->step * pixels, span);
      EXPECT_FALSE(chart->known);
      EXPECT_TRUE(chart->step < kMinute || chart->step % kMinute == 0);
    }
  }
}

}  // namespace
}  // namespace baudgate::history
