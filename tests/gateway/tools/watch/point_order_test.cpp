// In which order the points of a device are shown.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "gateway/tools/watch/point_image.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;

using Points = std::vector<std::string>;

PointOrder Order() {
  std::istringstream profiles(
      "voltage current_l1 current_l2 -reset\n"
      "current_l2 current_l1 energy -clear tariff\n"
      "clear reset_all -reset\n");
  return PointOrder(profiles);
}

Points Sorted(Points points, const PointOrder& order = Order()) {
  order.Sort(points);
  return points;
}

TEST(PointOrder, IsThatOfTheProfileThatHasTheMostOfThem) {
  EXPECT_THAT(Sorted({"current_l1", "current_l2", "voltage"}),
              ElementsAre("voltage", "current_l1", "current_l2"));
  EXPECT_THAT(Sorted({"current_l1", "current_l2", "energy"}),
              ElementsAre("current_l2", "current_l1", "energy"));
  EXPECT_THAT(Sorted({"current_l1", "current_l2"}), ElementsAre("current_l1", "current_l2"))
      << "the profile with the fewest others";
}

TEST(PointOrder, OthersComeBehindAsPeopleCount) {
  EXPECT_THAT(Sorted({"input_10", "input_2", "voltage", "a"}),
              ElementsAre("voltage", "a", "input_2", "input_10"));
  EXPECT_THAT(Sorted({"p10", "p2", "p02", "p"}, {}), ElementsAre("p", "p02", "p2", "p10"));
}

TEST(PointOrder, KnowsPointsThatCanOnlyBeWritten) {
  EXPECT_TRUE(Order().IsWriteOnly("reset"));
  EXPECT_FALSE(Order().IsWriteOnly("clear")) << "another profile reads it";
  EXPECT_FALSE(Order().IsWriteOnly("voltage"));
}

}  // namespace
}  // namespace baudgate
