// Which requests read a device's points: merging, holes, limits, splits and demotion.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/plan.h"

#include "tests/protocols/modbus/support.h"
#include "tests/support/times.h"

namespace baudgate::protocols::modbus {
namespace {

using config::Group;
using config::Type;

/// "fast holding 0+3 slow coil 5+1": group, table, address and count of each request.
std::string Shown(const SpacePlan& plan) {
  std::string text;
  for (std::size_t i = 0; i < plan.queries().size(); ++i) {
    const Block<Space>& block = plan.block(i);
    text += (text.empty() ? "" : " ") + std::string(config::Name(plan.queries()[i].group)) + " " +
            std::string(Name(block.key.table)) + " " + std::to_string(block.begin) + "+" +
            std::to_string(block.size());
  }
  return text;
}

SpacePlan Plan(const std::vector<config::Point>& points, const Settings& settings = {}) {
  return MakePlan(points, ReadLocations(points), settings);
}

std::vector<config::Point> Points(const std::vector<std::string>& reads, Type type = Type::uint16) {
  std::vector<config::Point> points;
  for (const std::string& read : reads) points.push_back(ReadPoint("p" + read, read, type));
  return points;
}

TEST(ModbusPlan, NeighboursShareARequest) {
  const auto points = Points({"holding 200", "holding 201", "holding 8", "input 200"});
  EXPECT_EQ(Shown(Plan(points, {})), "fast holding 8+1 fast holding 200+2 fast input 200+1");
}

TEST(ModbusPlan, HolesAreReadAlongUpToALimit) {
  const auto points = Points({"holding 0", "holding 9", "holding 19"});
  EXPECT_EQ(Shown(Plan(points, {})), "fast holding 0+10 fast holding 19+1");
  Settings none;
  none.hole = 0;
  EXPECT_EQ(Shown(Plan(points, none)), "fast holding 0+1 fast holding 9+1 fast holding 19+1");
  const auto bits = Points({"coil 0", "coil 129", "coil 259"}, Type::boolean);
  EXPECT_EQ(Shown(Plan(bits, {})), "fast coil 0+130 fast coil 259+1") << "16 bits a register";
}

TEST(ModbusPlan, NoRequestIsLongerThanABlock) {
  std::vector<std::string> reads;
  for (int i = 0; i < 130; ++i) reads.push_back("holding " + std::to_string(i));
  EXPECT_EQ(Shown(Plan(Points(reads), {})), "fast holding 0+120 fast holding 120+10");
  Settings small;
  small.block = 3;
  EXPECT_EQ(Shown(Plan(Points({"input 0", "input 2", "input 4"}, Type::float32), small)),
            "fast input 0+2 fast input 2+2 fast input 4+2")
      << "no point is split";
  small.block = 1;
  EXPECT_EQ(Shown(Plan(Points({"input 0"}, Type::float32), small)), "fast input 0+2");
}

TEST(ModbusPlan, GroupsAreApartAndWritePointsAreNotRead) {
  auto points = Points({"holding 0", "holding 1", "holding 2"});
  points[1].group = Group::slow;
  points.push_back(WritePoint("w", "", "holding 3"));
  EXPECT_EQ(Shown(Plan(points, {})), "fast holding 0+3 slow holding 1+1");
}

TEST(ModbusPlan, PointsOfOneRegisterShareIt) {
  auto points = Points({"holding 8[b0]", "holding 8[b15]"}, Type::boolean);
  points.push_back(ReadPoint("word", "holding 8"));
  points.push_back(ReadPoint("wide", "holding 7", Type::uint32));
  const SpacePlan plan = Plan(points);
  EXPECT_EQ(Shown(plan), "fast holding 7+2");
  EXPECT_EQ(plan.queries()[0].points.size(), 4U);
}

TEST(ModbusPlan, ARefusedBlockIsSplitUntilAReconnect) {
  SpacePlan plan = Plan(Points({"holding 0", "holding 1", "holding 5", "holding 8"}));
  ASSERT_EQ(Shown(plan), "fast holding 0+9");
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
  EXPECT_EQ(Shown(plan), "fast holding 0+2 fast holding 5+4");
  plan.OnReconnect();
  EXPECT_EQ(Shown(plan), "fast holding 0+9");
}

TEST(ModbusPlan, OverlappingPointsAreNotParted) {
  auto points = Points({"holding 8[b0]", "holding 8[b1]"}, Type::boolean);
  points.push_back(ReadPoint("word", "holding 8"));
  SpacePlan plan = Plan(points);
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "slow holding 8+1");
  EXPECT_EQ(plan.queries()[0].points.size(), 3U);
}

TEST(ModbusPlan, WhatIsRefusedIsAskedRarelyAndApart) {
  auto points = Points({"holding 0", "holding 1", "holding 2"});
  points[2].group = Group::slow;
  SpacePlan plan = Plan(points);
  ASSERT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
  ASSERT_EQ(Shown(plan), "fast holding 0+1 fast holding 1+1 slow holding 2+1");
  EXPECT_EQ(plan.OnRefused(1, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "fast holding 0+1 slow holding 2+1 slow holding 1+1");
  EXPECT_EQ(plan.OnRefused(2, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnAnswered(1, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnAnswered(2, kStart), PlanChange::restored) << "new firmware knows it";
  EXPECT_EQ(Shown(plan), "fast holding 0+1 fast holding 1+1 slow holding 2+1");
}

}  // namespace
}  // namespace baudgate::protocols::modbus
