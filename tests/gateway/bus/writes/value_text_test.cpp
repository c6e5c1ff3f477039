// What people type as a value.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "gateway/bus/writes/write_gate.h"

namespace baudgate {
namespace {

using config::Type;
using ::testing::HasSubstr;

config::Point ShortPoint(Type type) {
  config::Point point;
  point.name = "p";
  point.type = type;
  point.text_length = 4;
  return point;
}

TEST(ValueText, Bools) {
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
}  // namespace baudgate
