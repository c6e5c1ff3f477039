// How points are gathered into requests, and how requests are split when a device refuses them.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/conversation.h"
#include "tests/protocols/spabus/support.h"
#include "tests/support/times.h"

namespace baudgate::protocols::spabus {
namespace {

std::string Shown(const Block<Row>& block) {
  const Command command = ReadOf(1, block);
  const auto number = command.numbers ? std::optional(command.numbers->first) : std::nullopt;
  std::string text = FormatAddress({command.channels.first, command.category, number});
  if (command.channels.Count() > 1) {
    return std::to_string(command.channels.first) + "/" + std::to_string(command.channels.last) +
           FormatAddress({0, command.category, number});
  }
  if (command.ItemCount() > 1) text += "/" + std::to_string(command.numbers->last);
  return text;
}

std::vector<std::string> TextsOf(const ItemPlan& plan) {
  std::vector<std::string> asked;
  for (std::size_t i = 0; i < plan.queries().size(); ++i) asked.push_back(Shown(plan.block(i)));
  return asked;
}

std::vector<std::string> TextsOf(const std::vector<config::Point>& points,
                                 std::size_t most_items = 8) {
  const RequestLimits limits{most_items, true};
  return TextsOf(MakePlan(ReadablePoints(points), limits));
}

TEST(SpaPlan, NeighboursShareARequest) {
  EXPECT_EQ(TextsOf({MakePoint("I2"), MakePoint("I1"), MakePoint("I3")}), (Texts{"I1/3"}));
  EXPECT_EQ(TextsOf({MakePoint("I1"), MakePoint("I3")}), (Texts{"I1", "I3"})) << "no gap is filled";
  EXPECT_EQ(TextsOf({MakePoint("I1"), MakePoint("O2")}), (Texts{"I1", "O2"}));
  EXPECT_EQ(TextsOf({MakePoint("I1"), MakePoint("1I2")}), (Texts{"I1", "1I2"}));
  EXPECT_EQ(TextsOf({MakePoint("F"), MakePoint("C")}), (Texts{"F", "C"}));
}

TEST(SpaPlan, OneItemOfConsecutiveChannelsIsOneRequest) {
  std::vector<config::Point> points;
  for (int i = 1; i <= 16; ++i) points.push_back(MakePoint(std::to_string(i) + "I1"));
  EXPECT_EQ(TextsOf(points, 16), (Texts{"1/16I1"}));
  EXPECT_EQ(TextsOf(points), (Texts{"1/8I1", "9/16I1"}));
  EXPECT_EQ(TextsOf({MakePoint("2V5"), MakePoint("1V5"), MakePoint("4V5")}),
            (Texts{"1/2V5", "4V5"}));
  EXPECT_EQ(TextsOf({MakePoint("I1"), MakePoint("1I1")}), (Texts{"I1", "1I1"}))
      << "channel 0 is common to all";
  EXPECT_EQ(TextsOf({MakePoint("1I1"), MakePoint("1I2"), MakePoint("2I1"), MakePoint("2I2")}),
            (Texts{"1I1/2", "2I1/2"}))
      << "never both ranges at once";
  EXPECT_EQ(TextsOf({MakePoint("1F", Type::string), MakePoint("2F", Type::string)}),
            (Texts{"1F", "2F"}));
}

TEST(SpaPlan, ChannelsAreAskedOneByOneWhereTheDeviceDoesNotTakeARange) {
  const std::vector<config::Point> points = {MakePoint("1I1"), MakePoint("2I1"), MakePoint("S1"),
                                             MakePoint("S2")};
  RequestLimits limits;
  ItemPlan plan = MakePlan(ReadablePoints(points), limits);
  EXPECT_EQ(TextsOf(plan), (Texts{"1/2I1", "S1/2"}));
  limits.channels = false;
  plan.Make();
  EXPECT_EQ(TextsOf(plan), (Texts{"1I1", "2I1", "S1/2"}));
}

TEST(SpaPlan, GroupsStayApartAndFastOnesComeFirst) {
  EXPECT_EQ(TextsOf({MakePoint("I1", Type::float32, Group::slow), MakePoint("I2"),
                     MakePoint("F", Type::string, Group::once)}),
            (Texts{"I2", "I1", "F"}));
}

TEST(SpaPlan, SameItemTwiceIsAskedOnce) {
  const std::vector<config::Point> points = {MakePoint("V6"), MakePoint("V6"), MakePoint("V7"),
                                             MakePoint("C"), MakePoint("C")};
  const RequestLimits most;
  const ItemPlan plan = MakePlan(ReadablePoints(points), most);
  EXPECT_EQ(TextsOf(plan), (Texts{"V6/7", "C"}));
  EXPECT_EQ(plan.queries()[0].points, (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_EQ(plan.queries()[1].points, (std::vector<std::size_t>{3, 4}));
}

TEST(SpaPlan, KeepsWithinTheMostItems) {
  std::vector<config::Point> points;
  for (int i = 1; i <= 13; ++i) points.push_back(MakePoint("O" + std::to_string(i)));
  EXPECT_EQ(TextsOf(points), (Texts{"O1/8", "O9/13"}));
  EXPECT_EQ(TextsOf(points, 5), (Texts{"O1/5", "O6/10", "O11/13"}));
}

TEST(SpaPlan, SplitsAndMissingItemsDivideABlock) {
  std::vector<config::Point> points;
  for (int i = 1; i <= 6; ++i) points.push_back(MakePoint("O" + std::to_string(i)));
  const RequestLimits most;
  ItemPlan plan = MakePlan(ReadablePoints(points), most);
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
  EXPECT_EQ(TextsOf(plan), (Texts{"O1/3", "O4/6"}));
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
  EXPECT_EQ(TextsOf(plan), (Texts{"O1", "O2/3", "O4/6"}));
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart);
  EXPECT_EQ(TextsOf(plan), (Texts{"O2/3", "O4/6", "O1"})) << "what may be missing is asked rarely";
  plan.OnReconnect();
  EXPECT_EQ(TextsOf(plan), (Texts{"O1/6"})) << "it may be another relay now";
}

TEST(SpaPlan, WriteOnlyPointsAreNotRead) {
  EXPECT_TRUE(TextsOf({MakePoint("V101", Type::uint16, Group::fast, Access::write)}).empty());
}

}  // namespace
}  // namespace baudgate::protocols::spabus
