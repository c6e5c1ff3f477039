// Tests of the limits of writes, and of the decimal number that a float32 represents.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>

#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_gate.h"

namespace baudgate::bus {
namespace {

using config::Type;
using ::testing::HasSubstr;

config::Point SettingOf(Type type) {
  config::Point point;
  point.name = "setting";
  point.type = type;
  point.unit = "xIn";
  return point;
}

TEST(WriteLimits, MinimumAndMaximumBelongToTheRange) {
  config::Point point = SettingOf(Type::float32);
  point.writing.min = 0.5;
  point.writing.max = 40;
  for (const double good : {0.5, 0.51, 39.99, 40.0})
    EXPECT_EQ(WhyOutside(point, good), std::nullopt) << good;
  EXPECT_EQ(WhyOutside(point, 0.49), "0.49 is below the minimum, 0.5 xIn");
  EXPECT_EQ(WhyOutside(point, 40.01), "40.01 is above the maximum, 40 xIn");
  EXPECT_TRUE(WhyOutside(point, -HUGE_VAL));
  EXPECT_TRUE(WhyOutside(point, HUGE_VAL));
}

/// 0.1 as a float32 is 0.100000001490116. It must not exceed a limit of 0.1.
TEST(WriteLimits, AFloat32IsTakenAsItsShortestDecimal) {
  config::Point point = SettingOf(Type::float32);
  point.writing.max = 0.1;
  const Value sent = static_cast<double>(0.1F);
  EXPECT_TRUE(WhyOutside(point, sent));
  EXPECT_EQ(AsMeant(point, sent), Value(0.1));
  EXPECT_EQ(WhyOutside(point, AsMeant(point, sent)), std::nullopt);
  EXPECT_EQ(AsMeant(point, static_cast<double>(30.3F)), Value(30.3));
  for (int hundredths = 5; hundredths <= 30000; ++hundredths) {
    const double wanted = hundredths / 100.0;
    const Value meant = AsMeant(point, static_cast<double>(static_cast<float>(wanted)));
    ASSERT_EQ(meant, Value(wanted));
  }
  EXPECT_EQ(AsMeant(point, 0.1), Value(0.1)) << "typed by a person";
  EXPECT_EQ(AsMeant(SettingOf(Type::float64), static_cast<double>(0.1F)),
            Value(static_cast<double>(0.1F)))
      << "a client with 64 bits means all of them";
  EXPECT_EQ(AsMeant(SettingOf(Type::int16), std::int64_t{3}), Value(std::int64_t{3}));
}

TEST(WriteLimits, SmallAndLargeFloat32AreTakenAsTheirShortestDecimal) {
  config::Point point = SettingOf(Type::float32);
  EXPECT_EQ(AsMeant(point, static_cast<double>(0.0005F)), Value(0.0005));
  EXPECT_EQ(AsMeant(point, static_cast<double>(1.5e10F)), Value(1.5e10));
  EXPECT_EQ(AsMeant(point, static_cast<double>(1e-30F)), Value(1e-30));
  EXPECT_EQ(AsMeant(point, static_cast<double>(-3e38F)), Value(-3e38));
  point.writing.max = 0.0005;
  EXPECT_EQ(WhyOutside(point, AsMeant(point, static_cast<double>(0.0005F))), std::nullopt);
}

std::string Inexact(const config::Point& point, const Value& value) {
  return WhyInexact(point, value, Convert(point, 0, value).value()).value_or("");
}

/// With scale 10 the device accepts 40 or 50, so 46 would become 50: more than a maximum of 46.
TEST(WriteLimits, AValueThatTheDeviceCannotRepresentIsRefused) {
  config::Point point = SettingOf(Type::uint16);
  point.scale = 10;
  EXPECT_EQ(Inexact(point, std::int64_t{50}), "");
  EXPECT_EQ(Inexact(point, std::int64_t{46}),
            "the device cannot represent 46; the nearest value is 50");
  point.scale = 0.01;
  EXPECT_EQ(Inexact(point, std::int64_t{12}), "");
  point.scale = 1;
  EXPECT_NE(Inexact(point, 1.5), "") << "typed by a person";
  EXPECT_NE(Inexact(point, 65534.00001), "");
  EXPECT_NE(Inexact(SettingOf(Type::uint32), 4294967294.4), "") << "a fraction of a large number";
  point = SettingOf(Type::float32);
  point.scale = 0.1;
  point.offset = -5;
  for (int tenths = -500; tenths < 500; ++tenths) {
    ASSERT_EQ(Inexact(point, tenths / 10.0), "") << tenths;
  }
}

TEST(Convert, GivesTheRawAndTheShownValue) {
  struct Case {
    Type type;
    Decimal scale;
    Decimal offset;
    Value value;
    Value raw;
    Value shown;
  };
  const auto whole = [](std::int64_t number) { return Value(number); };
  const Case cases[] = {
      {Type::int16, 1, 0, whole(-32768), whole(-32768), whole(-32768)},
      {Type::int16, 1, 0, whole(32767), whole(32767), whole(32767)},
      {Type::int16, 0.1, -5, whole(25), whole(300), whole(25)},
      {Type::uint16, 10, 0, whole(46), whole(5), whole(50)},
      {Type::float32, 0.1, 0, 30.3, 303.0, 30.3},
      {Type::boolean, 1, 0, true, true, true},
      {Type::string, 1, 0, std::string("on"), std::string("on"), std::string("on")},
  };
  for (const Case& one : cases) {
    config::Point point = SettingOf(one.type);
    point.scale = one.scale;
    point.offset = one.offset;
    point.text_length = 8;
    const auto write = Convert(point, 7, one.value);
    ASSERT_TRUE(write) << write.error();
    EXPECT_EQ(write->point, 7U);
    EXPECT_EQ(ToText(write->raw), ToText(one.raw));
    EXPECT_EQ(ToText(write->shown), ToText(one.shown));
  }
  EXPECT_FALSE(Convert(SettingOf(Type::int16), 7, whole(32768)));
  EXPECT_FALSE(Convert(SettingOf(Type::boolean), 7, whole(2)));
  EXPECT_FALSE(Convert(SettingOf(Type::float32), 7, Value()));
}

TEST(WriteLimits, DecimalsAreCountedInTheUnscaledValue) {
  config::Point point = SettingOf(Type::float32);
  point.writing.decimals = 1;
  EXPECT_EQ(Inexact(point, 0.9), "");
  EXPECT_EQ(Inexact(point, 0.96),
            "0.96 has more digits than the device takes (1 after the decimal point)");
  point.scale = 400;
  EXPECT_EQ(Inexact(point, 360.0), "") << "0.9";
  EXPECT_NE(Inexact(point, 361.0), "");
}

TEST(WriteLimits, ASentinelCannotBeWritten) {
  config::Point point = SettingOf(Type::uint16);
  point.sentinels = {{999, Quality::bad_sensor_failure}};
  EXPECT_EQ(Inexact(point, std::int64_t{998}), "");
  EXPECT_EQ(Inexact(point, std::int64_t{999}),
            "999 is a code of this device and not a value ('sentinels'), so it cannot be written");
}

TEST(WriteLimits, StepsAreCountedFromZero) {
  config::Point point = SettingOf(Type::float32);
  point.writing.step = 0.1;
  for (int tenths = -1000; tenths <= 1000; ++tenths) {
    ASSERT_EQ(WhyOutside(point, tenths / 10.0), std::nullopt) << tenths;
  }
  EXPECT_EQ(WhyOutside(point, 0.55), "0.55 is not a multiple of 0.1 xIn");
  EXPECT_TRUE(WhyOutside(point, 0.1001));
  point.writing.step = 5;
  EXPECT_EQ(WhyOutside(point, std::int64_t{-15}), std::nullopt);
  EXPECT_TRUE(WhyOutside(point, std::int64_t{16}));
}

TEST(WriteLimits, LimitsApplyToWholeNumbers) {
  config::Point point = SettingOf(Type::uint16);
  point.unit.clear();
  point.writing.min = 1;
  point.writing.max = 2;
  EXPECT_EQ(WhyOutside(point, std::int64_t{2}), std::nullopt);
  EXPECT_EQ(WhyOutside(point, std::int64_t{3}), "3 is above the maximum, 2");
  EXPECT_TRUE(WhyOutside(point, std::uint64_t{1} << 63U));
}

/// The number below is 7.5 with its words exchanged.
TEST(WriteLimits, AFloat32InTheWrongWordOrderIsRefused) {
  const config::Point point = SettingOf(Type::float32);
  EXPECT_THAT(WhyOutside(point, 2.329518567093576e-41).value_or(""),
              HasSubstr("check the word order of the float"));
  EXPECT_EQ(WhyOutside(point, 0.0), std::nullopt);
  EXPECT_EQ(WhyOutside(point, -1e-30), std::nullopt);
}

TEST(WriteLimits, TextsHaveNoLimits) {
  EXPECT_EQ(WhyOutside(SettingOf(Type::string), std::string("anything")), std::nullopt);
}

config::Point ShortPoint(Type type) {
  config::Point point;
  point.name = "p";
  point.type = type;
  point.text_length = 4;
  return point;
}

TEST(ValueText, BoolsAreOnOffTrueFalseOneOrZero) {
  for (const char* yes : {"on", "true", "1"}) {
    EXPECT_EQ(ParseValue(ShortPoint(Type::boolean), yes).value(), Value(true)) << yes;
  }
  for (const char* no : {"off", "false", "0"}) {
    EXPECT_EQ(ParseValue(ShortPoint(Type::boolean), no).value(), Value(false)) << no;
  }
  for (const char* neither : {"", "2", "-1", "On", "yes", "0.0"}) {
    EXPECT_THAT(ParseValue(ShortPoint(Type::boolean), neither).error(), HasSubstr("on or off"));
  }
}

TEST(ValueText, NumbersAreExact) {
  const auto parse = [](const char* text) { return ParseValue(ShortPoint(Type::int64), text); };
  EXPECT_EQ(parse("-9223372036854775808").value(), Value(std::int64_t{INT64_MIN}));
  EXPECT_EQ(parse("18446744073709551615").value(), Value(UINT64_MAX));
  EXPECT_EQ(parse("-5").value(), Value(std::int64_t{-5}));
  EXPECT_EQ(parse("30.3").value(), Value(30.3));
  for (const char* wrong : {"", " ", "1,5", "0x10", "nan", "inf", "1 A", "one", "1e3", "1e999"}) {
    EXPECT_FALSE(parse(wrong)) << wrong;
  }
}

TEST(ValueText, TextsKeepTheirLength) {
  EXPECT_EQ(ParseValue(ShortPoint(Type::string), "abcd").value(), Value(std::string("abcd")));
  EXPECT_EQ(ParseValue(ShortPoint(Type::string), "").value(), Value(std::string()));
  EXPECT_THAT(ParseValue(ShortPoint(Type::string), "abcde").error(), HasSubstr("4 bytes"));
}

}  // namespace
}  // namespace baudgate::bus
