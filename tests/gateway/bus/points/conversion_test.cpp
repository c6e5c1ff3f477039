// Tests of `ToSample` and `ToRaw`: sentinels, scale and ranges, and values that are not numbers.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "gateway/bus/points/readings.h"

namespace baudgate::bus {
namespace {

using config::Type;

constexpr auto kMaxU64 = std::numeric_limits<std::uint64_t>::max();
constexpr auto kMaxI64 = std::numeric_limits<std::int64_t>::max();
constexpr auto kMinI64 = std::numeric_limits<std::int64_t>::min();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

config::Point PointOf(Type type, double scale = 1, double offset = 0) {
  config::Point point;
  point.type = type;
  point.scale = scale;
  point.offset = offset;
  point.text_length = 8;
  return point;
}

Sample Converted(const config::Point& point, Value raw, Quality quality = Quality::good) {
  return ToSample(point, protocols::Reading{0, std::move(raw), quality, {}});
}

void ExpectGood(const config::Point& point, Value raw, const Value& wanted) {
  const Sample sample = Converted(point, raw);
  EXPECT_EQ(sample.quality, Quality::good) << ToText(raw);
  EXPECT_EQ(sample.value, wanted) << ToText(sample.value);
}

void ExpectRefused(const config::Point& point, Value raw) {
  const Sample sample = Converted(point, raw);
  EXPECT_TRUE(IsBad(sample.quality)) << Name(point.type) << " took " << ToText(raw);
  EXPECT_FALSE(HasValue(sample.value)) << ToText(sample.value);
}

TEST(ToSample, ScaleAndOffsetAreApplied) {
  ExpectGood(PointOf(Type::float64, 0.5, 10), std::int64_t{4}, 12.0);
  ExpectGood(PointOf(Type::int16, 10, -1), 5.04, std::int64_t{49});
}

TEST(ToSample, EveryIntegerTypeRefusesValuesOutOfItsRange) {
  struct Case {
    Type type;
    double low;
    double high;
  };
  for (const Case& c :
       {Case{Type::int16, -32768, 32767}, Case{Type::uint16, 0, 65535},
        Case{Type::int32, -2147483648.0, 2147483647.0}, Case{Type::uint32, 0, 4294967295.0}}) {
    ExpectGood(PointOf(c.type), c.low, static_cast<std::int64_t>(c.low));
    ExpectGood(PointOf(c.type), c.high, static_cast<std::int64_t>(c.high));
    ExpectRefused(PointOf(c.type), c.low - 1);
    ExpectRefused(PointOf(c.type), c.high + 1);
    ExpectRefused(PointOf(c.type), std::int64_t{kMaxI64});
    ExpectRefused(PointOf(c.type), std::uint64_t{kMaxU64});
    ExpectRefused(PointOf(c.type), kInfinity);
  }
}

TEST(ToSample, SixtyFourBitsAreExact) {
  ExpectGood(PointOf(Type::uint64), kMaxU64, kMaxU64);
  ExpectGood(PointOf(Type::uint64), std::int64_t{9007199254740993},
             std::uint64_t{9007199254740993});
  ExpectGood(PointOf(Type::int64), std::int64_t{kMinI64}, std::int64_t{kMinI64});
  ExpectGood(PointOf(Type::int64), std::uint64_t{9007199254740993}, std::int64_t{9007199254740993});
  ExpectRefused(PointOf(Type::int64), kMaxU64);
  ExpectRefused(PointOf(Type::uint64), std::int64_t{-1});
  ExpectRefused(PointOf(Type::int64), 9.3e18);
  ExpectRefused(PointOf(Type::uint64), 1.9e19);
}

TEST(ToSample, SixtyFourBitsAreExactWhenScaled) {
  ExpectGood(PointOf(Type::uint64, 10), std::uint64_t{1152921504606846977},
             std::uint64_t{11529215046068469770U});
  ExpectGood(PointOf(Type::int64, 1, 2), std::int64_t{9007199254740993},
             std::int64_t{9007199254740995});
  ExpectRefused(PointOf(Type::uint64, 10), kMaxU64);
  EXPECT_EQ(*ToRaw(PointOf(Type::uint64, 10), std::uint64_t{11529215046068469770U}),
            Value(std::int64_t{1152921504606846977}));
  EXPECT_EQ(*ToRaw(PointOf(Type::int64, 1, 2), std::int64_t{9007199254740995}),
            Value(std::int64_t{9007199254740993}));
}

TEST(ToSample, SentinelsMatchWholeNumbersExactly) {
  config::Point point = PointOf(Type::uint64);
  point.sentinels = {{kMaxU64, Quality::bad_sensor_failure}};
  EXPECT_EQ(Converted(point, kMaxU64).quality,
            Quality(Quality::bad_sensor_failure, Reason::sentinel));
  ExpectGood(point, kMaxU64 - 1, kMaxU64 - 1);
}

TEST(ToSample, ScalingGivesTheExactDecimalResult) {
  ExpectGood(PointOf(Type::float64, 400), 0.57, 228.0);
  ExpectGood(PointOf(Type::float64, 0.1), std::int64_t{53}, 5.3);
  ExpectGood(PointOf(Type::float32, 0.001), static_cast<double>(1.1F), 0.0011);
  EXPECT_EQ(*ToRaw(PointOf(Type::float64, 400), Value(228.0)), Value(0.57));
}

TEST(ToSample, ATextThatIsTooLongIsRefused) {
  ExpectGood(PointOf(Type::string), std::string("12345678"), std::string("12345678"));
  ExpectRefused(PointOf(Type::string), std::string("123456789"));
  EXPECT_EQ(Converted(PointOf(Type::string), std::string("123456789")).quality,
            Quality(Quality::bad_configuration, Reason::out_of_range));
}

TEST(ToSample, BooleansAreZeroAndOneOnly) {
  ExpectGood(PointOf(Type::boolean), std::int64_t{0}, false);
  ExpectGood(PointOf(Type::boolean), 1.0, true);
  ExpectGood(PointOf(Type::boolean), true, true);
  ExpectRefused(PointOf(Type::boolean), std::int64_t{2});
  ExpectRefused(PointOf(Type::boolean), 0.5);
  ExpectRefused(PointOf(Type::boolean), kNan);
}

TEST(ToSample, FloatsMustBeFiniteAndInRange) {
  ExpectGood(PointOf(Type::float32), 3.25, 3.25);
  ExpectRefused(PointOf(Type::float32), 3.5e38);
  ExpectGood(PointOf(Type::float64), 3.5e38, 3.5e38);
  ExpectRefused(PointOf(Type::float64, 1e300), 1e300);
}

TEST(Conversion, AFloat32IsShownAsItsShortestDecimal) {
  ExpectGood(PointOf(Type::float32), static_cast<double>(5.3F), 5.3);
  ExpectGood(PointOf(Type::float32), static_cast<double>(-0.3F), -0.3);
  ExpectGood(PointOf(Type::float32), 123456792.0, 123456792.0);
  ExpectGood(PointOf(Type::float32), 1834523.25, 1834523.25);
  ExpectGood(PointOf(Type::float64), static_cast<double>(5.3F), static_cast<double>(5.3F));
  EXPECT_EQ(AsDecimal(1e300), 1e300);
}

TEST(ToSample, NoNumericTypeAcceptsNanInfinityOrText) {
  for (const Type type : {Type::boolean, Type::int16, Type::uint16, Type::int32, Type::uint32,
                          Type::int64, Type::uint64, Type::float32, Type::float64}) {
    for (const double scale : {1.0, 0.1, -2.0}) {
      const config::Point point = PointOf(type, scale);
      ExpectRefused(point, kNan);
      ExpectRefused(point, kInfinity);
      ExpectRefused(point, -kInfinity);
      ExpectRefused(point, std::string("12"));
    }
  }
}

TEST(ToSample, SentinelsAreComparedWithTheRawValue) {
  config::Point point = PointOf(Type::float64, 0.1);
  point.sentinels = {{999, Quality::bad_device_failure}, {-1, Quality::uncertain_last_usable}};
  Sample sample = Converted(point, 999.0);
  EXPECT_EQ(sample.quality, Quality::bad_device_failure);
  EXPECT_FALSE(HasValue(sample.value)) << "99.9 looks real";
  EXPECT_EQ(Converted(point, std::int64_t{-1}).quality, Quality::uncertain_last_usable);
  ExpectGood(point, 9990.0, 999.0);
}

TEST(ToSample, SentinelsMatchNumbersAsTheyAreShown) {
  struct Case {
    const char* sentinel;
    Value raw;
    bool meets;
  };
  const Case cases[] = {
      {"999.9", static_cast<double>(999.9F), true},
      {"-99.9", static_cast<double>(-99.9F), true},
      {"1e30", static_cast<double>(1e30F), true},
      {"3.4028235e38", static_cast<double>(std::numeric_limits<float>::max()), true},
      {"-3.402823466E+38", static_cast<double>(-std::numeric_limits<float>::max()), true},
      {"999.90", 999.9, true},
      {"999.9", 999.9001, false},
      {"999.9", static_cast<double>(999.8F), false},
      {"999.9", static_cast<double>(std::nextafter(999.9F, 0.0F)), false},
      {"16777217", 16777216.0, false},
      {"999.5001", 999.5, false},
      {"9.91e37", 9.91e37, true},
      {"9223372036854775807", std::int64_t{kMaxI64}, true},
      {"9223372036854775806", std::int64_t{kMaxI64}, false},
      {"-9223372036854775808", std::int64_t{kMinI64}, true},
  };
  for (const Case& one : cases) {
    for (const Type type : {Type::float32, Type::float64, Type::int64}) {
      config::Point point = PointOf(type);
      point.sentinels = {{*Decimal::Parse(one.sentinel), Quality::bad_device_failure}};
      const Quality met(Quality::bad_device_failure, Reason::sentinel);
      EXPECT_EQ(Converted(point, one.raw).quality == met, one.meets)
          << one.sentinel << " " << ToText(one.raw) << " " << Name(type);
    }
  }
}

TEST(ToSample, AFloat32PointRoundsItsValueToFloat32) {
  ExpectGood(PointOf(Type::float32), std::int64_t{16777217}, 16777216.0);
  ExpectGood(PointOf(Type::float32), std::uint64_t{4294967295}, 4294967296.0);
  ExpectGood(PointOf(Type::float32, 0.001), std::int64_t{123456789}, 123456.79);
  ExpectGood(PointOf(Type::float32, 0.1), std::int64_t{2304}, 230.4);
  ExpectGood(PointOf(Type::float32), 0.1 + 0.2, 0.3);
  ExpectGood(PointOf(Type::float64), std::int64_t{16777217}, 16777217.0);
  const double most = std::numeric_limits<float>::max();
  ExpectGood(PointOf(Type::float32), most, most);
  ExpectGood(PointOf(Type::float32), 3.4028235e38, most);
}

TEST(ToSample, AReadingBeyondMinAndMaxIsNotGood) {
  const Quality over(Quality::bad_sensor_failure, Reason::over_range);
  const Quality under(Quality::bad_sensor_failure, Reason::under_range);
  config::Point point = PointOf(Type::float32, 0.1);
  point.writing.min = -40;
  point.writing.max = 85.1;
  ExpectGood(point, std::int64_t{851}, 85.1);
  ExpectGood(point, std::int64_t{-400}, -40.0);
  EXPECT_EQ(Converted(point, std::int64_t{852}).quality, over);
  EXPECT_EQ(Converted(point, std::int64_t{-401}).quality, under);
  EXPECT_FALSE(HasValue(Converted(point, std::int64_t{852}).value));
  EXPECT_EQ(Converted(point, std::int64_t{852}, Quality::uncertain).quality, over);
  EXPECT_EQ(Converted(point, {}, Quality::bad_device_failure).quality, Quality::bad_device_failure);
  point.type = Type::float64;
  point.scale = 1;
  ExpectGood(point, static_cast<double>(85.1F), static_cast<double>(85.1F));
  config::Point whole = PointOf(Type::uint64);
  whole.writing.max = Decimal(kMaxU64 - 1);
  ExpectGood(whole, kMaxU64 - 1, kMaxU64 - 1);
  EXPECT_EQ(Converted(whole, kMaxU64).quality, over);
}

TEST(ToSample, AReadingOfAWritablePointMayLieOutsideMinAndMax) {
  config::Point point = PointOf(Type::uint16);
  point.access = config::Access::read_write;
  point.writing.max = 4;
  ExpectGood(point, std::int64_t{75}, std::int64_t{75});
}

TEST(ToSample, AReadingWithoutValueIsNeverGood) {
  EXPECT_TRUE(IsBad(Converted(PointOf(Type::float32), {}).quality));
  EXPECT_EQ(Converted(PointOf(Type::float32), {}, Quality::bad_sensor_failure).quality,
            Quality::bad_sensor_failure);
}

TEST(ToSample, AnUncertainQualityOfTheDeviceIsPreserved) {
  const Sample sample = Converted(PointOf(Type::float32), 1.5, Quality::uncertain_sub_normal);
  EXPECT_EQ(sample.quality, Quality::uncertain_sub_normal);
  EXPECT_EQ(sample.value, Value(1.5));
}

TEST(ToRaw, RemovesScaleAndOffset) {
  EXPECT_EQ(*ToRaw(PointOf(Type::float64, 0.5, 10), 12.0), Value(4.0));
  EXPECT_EQ(*ToRaw(PointOf(Type::uint16, 0.1), std::int64_t{25}), Value(std::int64_t{250}));
  EXPECT_EQ(*ToRaw(PointOf(Type::uint64), kMaxU64), Value(kMaxU64)) << "exact";
  EXPECT_EQ(*ToRaw(PointOf(Type::boolean), true), Value(true));
  EXPECT_EQ(*ToRaw(PointOf(Type::string), std::string("abc")), Value(std::string("abc")));
}

TEST(ToRaw, RefusesValuesThatDoNotFitTheType) {
  EXPECT_FALSE(ToRaw(PointOf(Type::float32), kNan));
  EXPECT_FALSE(ToRaw(PointOf(Type::float32, 2), kInfinity));
  EXPECT_FALSE(ToRaw(PointOf(Type::float32), 1e39));
  EXPECT_FALSE(ToRaw(PointOf(Type::uint16), std::int64_t{-1}));
  EXPECT_FALSE(ToRaw(PointOf(Type::int16), std::int64_t{40000}));
  EXPECT_FALSE(ToRaw(PointOf(Type::boolean), std::int64_t{2}));
  EXPECT_FALSE(ToRaw(PointOf(Type::int64), kMaxU64));
  EXPECT_FALSE(ToRaw(PointOf(Type::uint32, 1e-12), std::int64_t{4'000'000'000}))
      << "beyond 64 bits";
  EXPECT_FALSE(ToRaw(PointOf(Type::float32), {}));
}

TEST(ToRaw, RoundTripThroughTheDevice) {
  for (const double scale : {1.0, 0.1, 0.001, 10.0}) {
    for (std::int64_t shown = -300; shown <= 300; shown += 7) {
      const config::Point point = PointOf(Type::float64, scale, 5);
      const auto raw = ToRaw(point, static_cast<double>(shown));
      ASSERT_TRUE(raw);
      EXPECT_NEAR(ToDouble(Converted(point, *raw).value), static_cast<double>(shown), 1e-9);
    }
  }
}

TEST(EightBits, IntegersAndTimesOfDayAreRangeChecked) {
  ExpectGood(PointOf(Type::int8), std::int64_t{-128}, std::int64_t{-128});
  ExpectGood(PointOf(Type::uint8), std::int64_t{255}, std::int64_t{255});
  EXPECT_EQ(Converted(PointOf(Type::int8), std::int64_t{128}).quality,
            Quality(Quality::bad_configuration, Reason::out_of_range));
  config::Point noon = PointOf(Type::uint32, 1000);
  noon.time_type = config::TimeType::time_of_day;
  ExpectGood(noon, std::int64_t{43200}, std::int64_t{43'200'000});
  EXPECT_EQ(Converted(noon, std::int64_t{86400}).quality,
            Quality(Quality::bad_configuration, Reason::out_of_range));
}

}  // namespace
}  // namespace baudgate::bus
