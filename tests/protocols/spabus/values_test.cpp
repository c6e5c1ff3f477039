// What values look like on the SPA Bus, and what is never taken for a value.
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "gateway/base/text.h"
#include "protocols/spabus/points.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

Decoded DecodedAs(const std::string& text, Type type, double scale = 1) {
  config::Point point = MakePoint("V1", type);
  point.scale = scale;
  return DecodeValue(text, point);
}

TEST(SpaValue, DecodesByTypeOfThePoint) {
  EXPECT_EQ(DecodedAs("0.52", Type::float32).value, Value(0.52));
  EXPECT_EQ(DecodedAs(" -0.5", Type::float32).value, Value(-0.5));
  EXPECT_EQ(DecodedAs("+85", Type::uint16).value, Value(std::int64_t{85}));
  EXPECT_EQ(DecodedAs("085.00", Type::uint16).value, Value(std::int64_t{85}));
  EXPECT_EQ(DecodedAs("18446744073709551615", Type::uint64).value,
            Value(std::numeric_limits<std::uint64_t>::max()));
  EXPECT_EQ(DecodedAs("1", Type::boolean).value, Value(true));
  EXPECT_EQ(DecodedAs("0", Type::boolean).value, Value(false));
  EXPECT_EQ(DecodedAs(" SPAJ 142C ", Type::string).value, Value(std::string("SPAJ 142C")));
  EXPECT_EQ(DecodedAs("0.52", Type::int16, 100).value, Value(0.52)) << "the scale makes it whole";
}

TEST(SpaValue, NeverMakesANumberOfAnythingElse) {
  for (const auto& [text, type] :
       std::vector<std::pair<std::string, Type>>{{"2", Type::boolean},
                                                 {"0.5", Type::boolean},
                                                 {"true", Type::boolean},
                                                 {"0.52", Type::int16},
                                                 {"1e3", Type::float32},
                                                 {"nan", Type::float32},
                                                 {"inf", Type::float32},
                                                 {"1,5", Type::float32},
                                                 {"0x10", Type::uint16},
                                                 {"--", Type::float32},
                                                 {"1-2", Type::float32},
                                                 {"1 2", Type::float32}}) {
    const Decoded decoded = DecodedAs(text, type);
    EXPECT_FALSE(HasValue(decoded.value)) << text;
    EXPECT_EQ(decoded.quality, Quality::bad_configuration) << text;
  }
  EXPECT_EQ(DecodedAs("", Type::float32).quality, Quality::bad_sensor_failure);
  EXPECT_FALSE(HasValue(DecodedAs("  ", Type::float32).value));
}

std::string Encoded(const Value& value, Type type, double scale = 1) {
  config::Point point = MakePoint("V1", type);
  point.scale = scale;
  const auto text = EncodeValue(value, point);
  return text ? *text : "error";
}

TEST(SpaValue, EncodesWithoutNeedlessDigits) {
  EXPECT_EQ(Encoded(0.5, Type::float32), "0.5");
  EXPECT_EQ(Encoded(static_cast<double>(0.1F), Type::float32), "0.1");
  EXPECT_EQ(Encoded(4.0, Type::float32), "4");
  EXPECT_EQ(Encoded(-0.0, Type::float32), "0");
  EXPECT_EQ(Encoded(std::int64_t{85}, Type::uint16), "85");
  EXPECT_EQ(Encoded(std::uint64_t{85}, Type::uint16), "85");
  EXPECT_EQ(Encoded(1e6, Type::float64), "1000000");
  EXPECT_EQ(Encoded(true, Type::boolean), "1");
  EXPECT_EQ(Encoded(std::int64_t{0}, Type::boolean), "0");
  EXPECT_EQ(Encoded(0.52, Type::int16, 100), "0.52");
  EXPECT_EQ(Encoded(std::string("SUB 7"), Type::string), "SUB 7");
}

/// "30.3" of 3030, with whole numbers and text alone.
std::string HundredthsText(int hundredths) {
  std::string text = std::to_string(hundredths / 100);
  const int rest = hundredths % 100;
  if (rest == 0) return text;
  text += "." + std::to_string(rest / 10);
  if (rest % 10 != 0) text += std::to_string(rest % 10);
  return text;
}

/// A register that is written as 30.3 carries 30.299999237. All values of 0.05…300 in steps of
/// 0.01, those of 0.5…40 in steps of 0.1 among them: as the register has them, as 64 bits have
/// them, with the point's decimals and without.
TEST(SpaValue, EncodesTheDecimalsThatWereMeant) {
  config::Point settled = MakePoint("S23");
  settled.writing.decimals = 2;
  for (int hundredths = 5; hundredths <= 30000; ++hundredths) {
    const std::string meant = HundredthsText(hundredths);
    const float single = std::strtof(meant.c_str(), nullptr);
    const double full = std::strtod(meant.c_str(), nullptr);
    ASSERT_EQ(Encoded(static_cast<double>(single), Type::float32), meant);
    ASSERT_EQ(Encoded(full, Type::float32), meant);
    ASSERT_EQ(Encoded(full, Type::float64), meant);
    ASSERT_EQ(*EncodeValue(static_cast<double>(single), settled), meant);
    ASSERT_EQ(*EncodeValue(full, settled), meant);
  }
  EXPECT_EQ(Encoded(static_cast<double>(30.3F) / 0.1, Type::float32, 0.1), "303");
  EXPECT_EQ(Encoded(static_cast<double>(208.1F) / 400, Type::float32, 400), "0.52025");
}

TEST(SpaValue, TheTextOfAFloatReadsBackAsTheSameFloat) {
  std::mt19937 random(13);
  for (int i = 0; i < 20000; ++i) {
    const float number = std::ldexp(static_cast<float>(random() >> 8U), -18);
    const std::string text = Encoded(static_cast<double>(number), Type::float32);
    ASSERT_EQ(text.find_first_not_of("0123456789."), std::string::npos) << text;
    if (number < 1) continue;  // which may need more than nine decimals
    ASSERT_EQ(std::strtof(text.c_str(), nullptr), number) << text;
  }
}

std::string EncodedWith(int decimals, double number, double scale = 1) {
  config::Point point = MakePoint("S1");
  point.writing.decimals = decimals;
  point.scale = scale;
  const auto text = EncodeValue(number, point);
  return text ? *text : "error: " + text.error();
}

TEST(SpaValue, RoundsToTheDecimalsOfThePoint) {
  EXPECT_EQ(EncodedWith(2, 30.299999237060547), "30.3");
  EXPECT_EQ(EncodedWith(2, 0.524), "0.52");
  EXPECT_EQ(EncodedWith(2, 2.675), "2.68") << "though a double of 2.675 is less";
  EXPECT_EQ(EncodedWith(2, -2.675), "-2.68");
  EXPECT_EQ(EncodedWith(2, 9.995), "10");
  EXPECT_EQ(EncodedWith(2, -99.996), "-100");
  EXPECT_EQ(EncodedWith(0, 0.5), "1");
  EXPECT_EQ(EncodedWith(0, 12.4), "12");
  EXPECT_EQ(EncodedWith(3, 4), "4") << "no needless zeros";
  EXPECT_EQ(EncodedWith(9, 0.123456789), "0.12345679") << "more a float32 does not hold";
  EXPECT_EQ(EncodedWith(2, 208.1 / 400, 400), "0.52") << "they are counted on the wire";
  EXPECT_EQ(EncodedWith(2, 0.004),
            "error: 0.004, with the 2 decimals that 'p_S1' takes, is 0: too "
            "small to be written");
}

TEST(SpaValue, RoundingDoesNotLeadOutOfTheLimits) {
  config::Point point = MakePoint("S1");
  point.writing.decimals = 1;
  point.writing.min = 0.25;
  point.writing.max = 2.55;
  EXPECT_EQ(*EncodeValue(0.25, point), "0.3");
  EXPECT_EQ(*EncodeValue(2.54, point), "2.5");
  EXPECT_FALSE(EncodeValue(2.55, point)) << "it would be 2.6";
  point.writing.decimals = 2;
  EXPECT_EQ(*EncodeValue(static_cast<double>(2.55F), point), "2.55");
  point.scale = 400;
  point.writing.max = 1020;
  EXPECT_EQ(*EncodeValue(2.55, point), "2.55") << "limits are in units of the value";
}

TEST(SpaValue, NeverAnExponent) {
  EXPECT_EQ(Encoded(1e12, Type::float64), "1000000000000");
  EXPECT_EQ(Encoded(123456789012.5, Type::float64), "123456789012.5");
  EXPECT_EQ(Encoded(16777216.0, Type::float32), "16777216");
  EXPECT_EQ(Encoded(0.000001, Type::float32), "0.000001");
  EXPECT_EQ(Encoded(std::int64_t{9007199254740991}, Type::int64), "9007199254740991");
  EXPECT_EQ(Encoded(0.1 + 0.2, Type::float64), "0.3");
}

TEST(SpaValue, RefusesWhatDoesNotFit) {
  EXPECT_EQ(Encoded(std::int64_t{70000}, Type::uint16), "error");
  EXPECT_EQ(Encoded(std::int64_t{-1}, Type::uint16), "error");
  EXPECT_EQ(Encoded(0.5, Type::uint16), "error");
  EXPECT_EQ(Encoded(std::int64_t{2}, Type::boolean), "error");
  EXPECT_EQ(Encoded(std::nan(""), Type::float32), "error");
  EXPECT_EQ(Encoded(Value(), Type::float32), "error");
  EXPECT_EQ(Encoded(1e-10, Type::float32), "error") << "it would become 0";
  EXPECT_EQ(Encoded(1e300, Type::float64), "error");
  EXPECT_EQ(Encoded(std::string("1"), Type::uint16), "error");
  EXPECT_EQ(Encoded(1.0, Type::string), "error");
}

TEST(SpaValue, NobodyCanInjectASecondFrame) {
  for (const char* text : {"a:b", "a/b", "a<b", "a>b", "a&b", "a\rb", "a\nb", "\x80", ""}) {
    EXPECT_EQ(Encoded(std::string(text), Type::string), "error") << text;
  }
  EXPECT_EQ(Encoded(std::string(132, 'x'), Type::string), "error");
}

TEST(SpaValue, PrintsAsARelayDoes) {
  EXPECT_EQ(PrintValue(0.5, MakePoint("I1")), "0.50");
  EXPECT_EQ(PrintValue(0.4567891, MakePoint("I1")), "0.4568");
  config::Point settled = MakePoint("S1");
  settled.writing.decimals = 3;
  EXPECT_EQ(PrintValue(0.4567891, settled), "0.457");
  settled.writing.decimals = 1;
  EXPECT_EQ(PrintValue(0.5, settled), "0.5");
  EXPECT_EQ(PrintValue(85.0, MakePoint("V1", Type::uint16)), "85");
  EXPECT_EQ(PrintValue(1.0, MakePoint("O1", Type::boolean)), "1");
  EXPECT_EQ(PrintValue(std::string("a:b"), MakePoint("F", Type::string)), "a-b");
}

}  // namespace
}  // namespace baudgate::protocols::spabus
