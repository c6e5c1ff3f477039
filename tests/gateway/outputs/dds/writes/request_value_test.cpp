// The value of a request for points of every kind.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <limits>

#include "gateway/outputs/dds/writes/write_service.h"

namespace baudgate::dds {
namespace {

using config::Type;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Case {
  Type type;
  double value;
  std::string text;
  std::optional<Value> meant;  ///< nothing: refused
};

TEST(RequestValue, TextCountsUnlessItIsEmpty) {
  const std::string hostile("1\0", 2);
  const Case cases[] = {
      {Type::uint16, 1, "", Value(std::int64_t{1})},
      {Type::uint16, -0.0, "", Value(std::int64_t{0})},
      {Type::uint16, 1, "2", Value(std::int64_t{2})},
      {Type::uint16, kNaN, "2", Value(std::int64_t{2})},
      {Type::uint16, kNaN, "", {}},
      {Type::uint16, kInfinite, "", {}},
      {Type::uint16, 1, "two", {}},
      {Type::uint16, 1, " 2", {}},
      {Type::int32, -7, "", Value(std::int64_t{-7})},
      {Type::uint64, 9007199254740992.0, "", Value(std::int64_t{9007199254740992})},
      {Type::uint64, 1e15, "", Value(std::int64_t{1000000000000000})},
      {Type::uint64, 9007199254740994.0, "", {}},
      {Type::uint64, 1e300, "", {}},
      {Type::uint64, kNaN, "18446744073709551615", Value(std::uint64_t{18446744073709551615ULL})},
      {Type::boolean, 1, "", Value(true)},
      {Type::boolean, 0, "", Value(false)},
      {Type::boolean, 2, "", {}},
      {Type::boolean, 0.5, "", {}},
      {Type::boolean, 0, "on", Value(true)},
      {Type::boolean, kNaN, "off", Value(false)},
      {Type::float32, 0.1, "", Value(0.1)},
      {Type::float32, 1e20, "", Value(1e20)},
      {Type::float64, 1e-9, "", Value(1e-9)},
      {Type::float64, kNaN, "", {}},
      {Type::float64, -kInfinite, "", {}},
      {Type::float64, 1, "nan", {}},
      {Type::float64, 1, "inf", {}},
      {Type::float64, 1, hostile, {}},
      {Type::string, 1, "on", Value(std::string("on"))},
      {Type::string, 1, "", Value(std::string())},
      {Type::string, 1, "longer than it is", {}},
  };
  for (const Case& one : cases) {
    config::Point point;
    point.name = "p";
    point.type = one.type;
    point.text_length = 8;
    RequestSample request;
    request.value = one.value;
    request.text = one.text;
    const auto value = ValueOf(point, request);
    const std::string which =
        std::string(Name(one.type)) + " " + std::to_string(one.value) + " '" + one.text + "'";
    ASSERT_EQ(value.ok(), one.meant.has_value()) << which;
    if (value.ok()) {
      EXPECT_EQ(*value, *one.meant) << which;
    } else {
      EXPECT_FALSE(value.error().empty());
    }
  }
}

}  // namespace
}  // namespace baudgate::dds
