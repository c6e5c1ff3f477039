// What values look like on the SPA Bus, and what is never taken for a value.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/values.h"

#include <cmath>
#include <limits>

#include "gateway/base/text.h"
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

/// A register that is written as 30.3 carries 30.299999237.
TEST(SpaValue, EncodesTheDecimalsThatAFloatWasGiven) {
  for (int hundredths = 5; hundredths <= 30000; ++hundredths) {
    const double meant = hundredths / 100.0;
    const auto carried = static_cast<double>(static_cast<float>(meant));
    ASSERT_EQ(Encoded(carried, Type::float32), FormatNumber(meant));
  }
  EXPECT_EQ(Encoded(static_cast<double>(30.3F) / 0.1, Type::float32, 0.1), "303");
}

TEST(SpaValue, RefusesWhatDoesNotFit) {
  EXPECT_EQ(Encoded(std::int64_t{70000}, Type::uint16), "error");
  EXPECT_EQ(Encoded(std::int64_t{-1}, Type::uint16), "error");
  EXPECT_EQ(Encoded(0.5, Type::uint16), "error");
  EXPECT_EQ(Encoded(std::int64_t{2}, Type::boolean), "error");
  EXPECT_EQ(Encoded(std::nan(""), Type::float32), "error");
  EXPECT_EQ(Encoded(Value(), Type::float32), "error");
  EXPECT_EQ(Encoded(1e-9, Type::float32), "error") << "it would become 0";
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
  EXPECT_EQ(PrintValue(85.0, MakePoint("V1", Type::uint16)), "85");
  EXPECT_EQ(PrintValue(1.0, MakePoint("O1", Type::boolean)), "1");
  EXPECT_EQ(PrintValue(std::string("a:b"), MakePoint("F", Type::string)), "a-b");
}

}  // namespace
}  // namespace baudgate::protocols::spabus
