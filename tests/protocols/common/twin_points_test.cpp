// Points of a simulated device by their addresses.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/twin_points.h"

#include <gtest/gtest.h>

#include <map>

namespace baudgate {
namespace {

class Values : public TwinValues {
 public:
  Value Get(std::size_t point, Instant) const override { return values.at(point); }
  void Set(std::size_t point, const Value& value) override { values[point] = value; }

  std::map<std::size_t, Value> values;
};

config::Point MakePoint(const char* read, const char* write, config::Access access) {
  config::Point point;
  point.read = read;
  point.write = write;
  point.access = access;
  return point;
}

/// An address here is any text but "bad".
Result<std::string> Parse(const std::string& text) {
  if (text == "bad") return Error{"bad"};
  return text;
}

TEST(TwinPoints, AreFoundByWhatMayBeDoneWithThem) {
  config::Device device;
  device.points = {MakePoint("bad", "", config::Access::read),
                   MakePoint("r", "w", config::Access::read),
                   MakePoint("both", "both", config::Access::read_write),
                   MakePoint("x", "w", config::Access::write)};
  Values values;
  const TwinPoints<std::string> points(
      device, values, [](const config::Point& point) { return Parse(point.read); },
      [](const config::Point& point) { return Parse(point.write); });
  const auto index = [](const auto* one) { return one == nullptr ? 99 : one->index; };
  const auto is = [](const char* wanted) {
    return [wanted](const std::string& text) { return text == wanted; };
  };
  EXPECT_EQ(points.all().size(), 4U);
  EXPECT_EQ(index(points.Find(is("bad"))), 99U);
  EXPECT_EQ(index(points.Find(is("r"))), 1U);
  EXPECT_EQ(index(points.Find(is("x"))), 99U) << "write-only";
  EXPECT_EQ(index(points.FindWritable(is("w"))), 3U) << "the first is read-only";
  EXPECT_EQ(index(points.FindWritable(is("both"))), 2U);
}

TEST(TwinPoints, GetAndSetTheirOwnValue) {
  config::Device device;
  device.points = {MakePoint("a", "a", config::Access::read_write),
                   MakePoint("b", "b", config::Access::read_write)};
  Values values;
  values.values = {{0, 1.5}, {1, 2.5}};
  const auto parse = [](const config::Point& point) { return Parse(point.read); };
  TwinPoints<std::string> points(device, values, parse, parse);
  const auto* one = points.Find([](const std::string& text) { return text == "b"; });
  ASSERT_NE(one, nullptr);
  EXPECT_EQ(points.Get(*one, {}), Value(2.5));
  points.Set(*one, 7.0);
  EXPECT_EQ(values.values[1], Value(7.0));
  EXPECT_EQ(values.values[0], Value(1.5));
}

}  // namespace
}  // namespace baudgate
