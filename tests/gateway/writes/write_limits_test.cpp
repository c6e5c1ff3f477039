// Which numbers may be written, and which number a client meant.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/writes/write_limits.h"

#include <gmock/gmock.h>

#include <cmath>

namespace baudgate {
namespace {

using config::Type;
using ::testing::HasSubstr;

config::Point PointOf(Type type) {
  config::Point point;
  point.name = "setting";
  point.type = type;
  point.unit = "xIn";
  return point;
}

TEST(WriteLimits, TheEndsBelongToTheRange) {
  config::Point point = PointOf(Type::float32);
  point.writing.min = 0.5;
  point.writing.max = 40;
  for (const double good : {0.5, 0.51, 39.99, 40.0}) EXPECT_EQ(WhyOutside(point, good), "") << good;
  EXPECT_EQ(WhyOutside(point, 0.49), "0.49 is below the least that may be written, 0.5 xIn");
  EXPECT_EQ(WhyOutside(point, 40.01), "40.01 is above the most that may be written, 40 xIn");
  EXPECT_NE(WhyOutside(point, -HUGE_VAL), "");
  EXPECT_NE(WhyOutside(point, HUGE_VAL), "");
}

/// 0.1 as float32 is 0.100000001490116; a limit of 0.1 is not passed by it.
TEST(WriteLimits, AFloat32IsTheDecimalNumberThatWasMeant) {
  config::Point point = PointOf(Type::float32);
  point.writing.max = 0.1;
  const Value sent = static_cast<double>(0.1F);
  EXPECT_NE(WhyOutside(point, sent), "");
  EXPECT_EQ(AsMeant(point, sent), Value(0.1));
  EXPECT_EQ(WhyOutside(point, AsMeant(point, sent)), "");
  EXPECT_EQ(AsMeant(point, static_cast<double>(30.3F)), Value(30.3));
  for (int hundredths = 5; hundredths <= 30000; ++hundredths) {
    const double wanted = hundredths / 100.0;
    const Value meant = AsMeant(point, static_cast<double>(static_cast<float>(wanted)));
    ASSERT_EQ(meant, Value(wanted));
  }
  EXPECT_EQ(AsMeant(point, 0.1), Value(0.1)) << "typed by a person";
  EXPECT_EQ(AsMeant(PointOf(Type::float64), static_cast<double>(0.1F)),
            Value(static_cast<double>(0.1F)))
      << "a client with 64 bits means all of them";
  EXPECT_EQ(AsMeant(PointOf(Type::int16), std::int64_t{3}), Value(std::int64_t{3}));
}

TEST(WriteLimits, StepsAreCountedFromZero) {
  config::Point point = PointOf(Type::float32);
  point.writing.step = 0.1;
  for (int tenths = -1000; tenths <= 1000; ++tenths) {
    ASSERT_EQ(WhyOutside(point, tenths / 10.0), "") << tenths;
  }
  EXPECT_EQ(WhyOutside(point, 0.55), "0.55 is no multiple of 0.1 xIn");
  EXPECT_NE(WhyOutside(point, 0.1001), "");
  point.writing.step = 5;
  EXPECT_EQ(WhyOutside(point, std::int64_t{-15}), "");
  EXPECT_NE(WhyOutside(point, std::int64_t{16}), "");
}

TEST(WriteLimits, WholeNumbersToo) {
  config::Point point = PointOf(Type::uint16);
  point.unit.clear();
  point.writing.min = 1;
  point.writing.max = 2;
  EXPECT_EQ(WhyOutside(point, std::int64_t{2}), "");
  EXPECT_EQ(WhyOutside(point, std::int64_t{3}), "3 is above the most that may be written, 2");
  EXPECT_NE(WhyOutside(point, std::uint64_t{1} << 63U), "");
}

TEST(WriteLimits, TextsHaveNone) {
  EXPECT_EQ(WhyOutside(PointOf(Type::string), std::string("anything")), "");
}

}  // namespace
}  // namespace baudgate
