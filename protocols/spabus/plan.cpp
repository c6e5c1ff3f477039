// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/plan.h"

namespace baudgate::protocols::spabus {

ItemPlan MakePlan(std::span<const ReadPoint> points, const std::size_t& most_items) {
  ItemPlan plan({.may_join =
                     [&most_items](const Block<Row>& block, const Block<Row>& next) {
                       return next.begin == block.end && block.size() < most_items;
                     },
                 .refused = WhenRefused::drop,
                 .keeps_splits = false});
  for (const ReadPoint& point : points) {
    const std::size_t number = point.address.number.value_or(0);
    plan.Add(point.point->group, point.index, {point.address.channel, point.address.category},
             number, number + 1);
  }
  plan.Make();
  return plan;
}

Command ReadOf(unsigned slave, const Block<Row>& block) {
  Address first{block.key.channel, block.key.category, std::nullopt};
  if (TakesNumber(first.category)) first.number = static_cast<std::uint32_t>(block.begin);
  return ReadOf(slave, first, static_cast<std::uint32_t>(block.end - 1));
}

}  // namespace baudgate::protocols::spabus
