// Decimal numbers: exact where people expect it, and where 64 bits hold them.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/decimal.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace baudgate {
namespace {

constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();

Decimal Number(std::string_view text) { return Decimal::Parse(text).value_or(-999); }

TEST(Decimals, AreReadAndWritten) {
  struct Case {
    const char* text;
    const char* shown;
  };
  for (const auto& [text, shown] : {Case{"0", "0"},
                                    {"-0.0", "0"},
                                    {"+7", "7"},
                                    {"007", "7"},
                                    {"100", "100"},
                                    {"-12.50", "-12.5"},
                                    {"0.001", "0.001"},
                                    {".5", "0.5"},
                                    {"18446744073709551615", "18446744073709551615"},
                                    {"-9223372036854775808", "-9223372036854775808"},
                                    {"9007199254740993", "9007199254740993"},
                                    {"0.1234567890123456789", "0.1234567890123456789"},
                                    {"123456789012345678901", "123456789012345678900"},
                                    {"1e3", "1000"},
                                    {"-1.5E-3", "-0.0015"},
                                    {"9.91e+37", "991e35"},
                                    {"0xFFFF", "65535"},
                                    {"0xffffffffffffffff", "18446744073709551615"}}) {
    const auto number = Decimal::Parse(text);
    ASSERT_TRUE(number) << text;
    EXPECT_EQ(number->ToText(), shown) << text;
  }
  for (const char* text : {"", "-", ".", "e3", "1e", "1e+-3", "1e400", "1e3e3", "1,5", "0x",
                           "0x1FFFFFFFFFFFFFFFF", "nan", "1 "}) {
    EXPECT_FALSE(Decimal::Parse(text)) << text;
  }
}

TEST(Decimals, AreWhatADoubleIsMeantAs) {
  EXPECT_EQ(Decimal(0.57), Number("0.57"));
  EXPECT_EQ(Decimal(-0.0), 0);
  EXPECT_EQ(Decimal(1e300).ToDouble(), 1e300);
  EXPECT_EQ(Decimal(5e-324).ToDouble(), 5e-324);
  EXPECT_EQ(Decimal(400.0), 400);
  for (const double number : {0.1, 1.0 / 3, 227.99999999999997, 1.7976931348623157e308}) {
    EXPECT_EQ(Decimal(number).ToDouble(), number);
  }
}

TEST(Decimals, MultiplyAsPeopleDo) {
  EXPECT_EQ((Decimal(0.57) * 400).ToDouble(), 228.0);
  EXPECT_EQ(Number("0.1") * 3, Number("0.3"));
  EXPECT_EQ(Decimal(kMost) * 1, kMost);
  EXPECT_EQ(Decimal(kLeast) * Number("-0.1"), Number("922337203685477580.8"));
  EXPECT_EQ(Number("1152921504606846977") * 10, Number("11529215046068469770"));
  // 39 digits are rounded to what 64 bits hold.
  EXPECT_EQ((Decimal(kMost) * kMost).ToDouble(), 3.4028236692093846e38);
}

TEST(Decimals, AddAndCompareExactly) {
  EXPECT_EQ(Decimal(kMost) + kLeast, (std::uint64_t{1} << 63U) - 1);
  EXPECT_EQ(Decimal(kMost) - kMost, 0);
  EXPECT_EQ(Number("0.1") + Number("0.2"), Number("0.3"));
  EXPECT_EQ(Decimal(1e300) + 1, Decimal(1e300));
  EXPECT_EQ(Number("18446744073709551615") + Number("0.25"), kMost) << "20 digits, and no more";
  EXPECT_LT(Decimal(kMost - 1), kMost);
  EXPECT_GT(Number("9007199254740993"), std::int64_t{9007199254740992});
  EXPECT_LT(Decimal(-1), 1);
  EXPECT_LT(Decimal(-2), -1);
  EXPECT_LT(Number("0.0000001"), Number("0.1"));
  EXPECT_GT(Decimal(1e300), Decimal(1e-300));
}

TEST(Decimals, DivideWithMoreDigitsThanADouble) {
  EXPECT_EQ(Decimal(228) / 400, Number("0.57"));
  EXPECT_EQ((Decimal(1) / 3).ToDouble(), 1.0 / 3);
  EXPECT_EQ((Decimal(2) / -3).ToDouble(), -2.0 / 3);
  EXPECT_EQ(Number("11529215046068469770") / 10, Number("1152921504606846977"));
  EXPECT_EQ(Decimal(0) / 7, 0);
}

TEST(Decimals, RoundHalvesAwayFromZero) {
  EXPECT_EQ(Number("0.5").ToInt64(), 1);
  EXPECT_EQ(Number("-0.5").ToInt64(), -1);
  EXPECT_EQ(Number("0.49999").ToInt64(), 0);
  EXPECT_EQ(Number("2.5").ToUint64(), 3U);
  EXPECT_EQ(Number("-0.4").ToUint64(), 0U);
  EXPECT_EQ(Number("-0.5").ToUint64(), std::nullopt);
  EXPECT_EQ(Decimal(kLeast).ToInt64(), kLeast);
  EXPECT_EQ((Decimal(kLeast) - 1).ToInt64(), std::nullopt);
  EXPECT_EQ(Decimal(kMost).ToUint64(), kMost);
  EXPECT_EQ(Decimal(kMost).ToInt64(), std::nullopt);
  EXPECT_EQ(Decimal(1e300).ToUint64(), std::nullopt);
  EXPECT_EQ(Decimal(1e-300).ToUint64(), 0U);
}

TEST(Decimals, AreMultiplesOfAStep) {
  EXPECT_TRUE(Number("0.3").IsMultipleOf(Number("0.1")));
  EXPECT_TRUE(Decimal(20).IsMultipleOf(10));
  EXPECT_TRUE(Decimal(0).IsMultipleOf(7));
  EXPECT_TRUE(Decimal(1e300).IsMultipleOf(Number("0.1")));
  EXPECT_TRUE(Decimal(1000).IsMultipleOf(8));
  EXPECT_FALSE(Decimal(25).IsMultipleOf(10));
  EXPECT_FALSE(Number("0.25").IsMultipleOf(Number("0.1")));
  EXPECT_FALSE(Number("9007199254740993").IsMultipleOf(2));
  EXPECT_TRUE(Number("9007199254740994").IsMultipleOf(2));
  EXPECT_FALSE(Decimal(5).IsMultipleOf(0));
}

TEST(Decimals, BecomeValues) {
  EXPECT_EQ(Decimal(kMost).ToValue(), Value(kMost));
  EXPECT_EQ(Decimal(-5).ToValue(), Value(std::int64_t{-5}));
  EXPECT_EQ(Number("0.57").ToValue(), Value(0.57));
  EXPECT_EQ(Decimal::Of(Value(true)), Decimal(1));
  EXPECT_EQ(Decimal::Of(Value(std::string("5"))), std::nullopt);
  EXPECT_EQ(Decimal::Of(Value(std::numeric_limits<double>::quiet_NaN())), std::nullopt);
  EXPECT_EQ(Decimal::Of(Value()), std::nullopt);
}

}  // namespace
}  // namespace baudgate
