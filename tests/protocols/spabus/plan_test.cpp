// How points are gathered into requests, and how requests are split when a device refuses them.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/plan.h"

#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

std::vector<std::string> Asked(const std::vector<config::Point>& points,
                               const Learned& learned = {}) {
  std::vector<std::string> asked;
  const Plan plan = MakePlan(ReadablePoints(points), learned);
  EXPECT_EQ(plan.queries.size(), plan.blocks.size());
  for (const Block& block : plan.blocks) {
    std::string text = FormatAddress(block.first);
    if (block.ItemCount() > 1) text += "/" + std::to_string(block.last);
    asked.push_back(text);
  }
  return asked;
}

using Texts = std::vector<std::string>;

TEST(SpaPlan, NeighboursShareARequest) {
  EXPECT_EQ(Asked({MakePoint("I2"), MakePoint("I1"), MakePoint("I3")}), (Texts{"I1/3"}));
  EXPECT_EQ(Asked({MakePoint("I1"), MakePoint("I3")}), (Texts{"I1", "I3"})) << "no gap is filled";
  EXPECT_EQ(Asked({MakePoint("I1"), MakePoint("O2")}), (Texts{"I1", "O2"}));
  EXPECT_EQ(Asked({MakePoint("I1"), MakePoint("1I2")}), (Texts{"I1", "1I2"}));
  EXPECT_EQ(Asked({MakePoint("F"), MakePoint("C")}), (Texts{"C", "F"}));
}

TEST(SpaPlan, GroupsStayApartAndFastOnesComeFirst) {
  EXPECT_EQ(Asked({MakePoint("I1", Type::float32, Group::slow), MakePoint("I2"),
                   MakePoint("F", Type::string, Group::once)}),
            (Texts{"I2", "I1", "F"}));
}

TEST(SpaPlan, SameItemTwiceIsAskedOnce) {
  const std::vector<config::Point> points = {MakePoint("V6"), MakePoint("V6"), MakePoint("V7"),
                                             MakePoint("C"), MakePoint("C")};
  EXPECT_EQ(Asked(points), (Texts{"C", "V6/7"}));
  const Plan plan = MakePlan(ReadablePoints(points), {});
  EXPECT_EQ(plan.queries[0].points, (std::vector<std::size_t>{3, 4}));
  EXPECT_EQ(plan.queries[1].points, (std::vector<std::size_t>{0, 1, 2}));
}

TEST(SpaPlan, KeepsWithinTheMostItems) {
  std::vector<config::Point> points;
  for (int i = 1; i <= 13; ++i) points.push_back(MakePoint("O" + std::to_string(i)));
  EXPECT_EQ(Asked(points), (Texts{"O1/8", "O9/13"}));
  Learned learned;
  learned.max_items = 5;
  EXPECT_EQ(Asked(points, learned), (Texts{"O1/5", "O6/10", "O11/13"}));
}

TEST(SpaPlan, CutsAndMissingItemsDivideABlock) {
  std::vector<config::Point> points;
  for (int i = 1; i <= 6; ++i) points.push_back(MakePoint("O" + std::to_string(i)));
  Learned learned;
  learned.cuts.insert({0, 'O', 4});
  EXPECT_EQ(Asked(points, learned), (Texts{"O1/3", "O4/6"}));
  learned.missing.insert({0, 'O', 2});
  EXPECT_EQ(Asked(points, learned), (Texts{"O1", "O3", "O4/6"}));
}

TEST(SpaPlan, WriteOnlyPointsAreNotRead) {
  EXPECT_TRUE(Asked({MakePoint("V101", Type::uint16, Group::fast, Access::write)}).empty());
}

}  // namespace
}  // namespace baudgate::protocols::spabus
