// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/plan.h"

#include <algorithm>
#include <tuple>

namespace baudgate::protocols::spabus {
namespace {

/// Whether `next` may join the block, either as its next item or as another point of its last one.
bool Joins(const Block& block, const Address& next, const Learned& learned) {
  if (next.channel != block.first.channel || next.category != block.first.category) return false;
  if (!next.number) return true;  // the same single item once more
  if (*next.number == block.last) return true;
  return *next.number == block.last + 1 && block.ItemCount() < learned.max_items &&
         !learned.cuts.contains(next);
}

}  // namespace

Address Block::Middle() const {
  Address middle = first;
  middle.number = first.number.value_or(0) + static_cast<std::uint32_t>(ItemCount() / 2);
  return middle;
}

Plan MakePlan(std::span<const ReadPoint> points, const Learned& learned) {
  std::vector<ReadPoint> sorted(points.begin(), points.end());
  std::erase_if(sorted, [&](const ReadPoint& p) { return learned.missing.contains(p.address); });
  const auto rank = [](const ReadPoint& p) {
    return std::make_tuple(-static_cast<int>(p.point->group), p.address, p.index);
  };
  std::sort(sorted.begin(), sorted.end(),
            [&](const ReadPoint& a, const ReadPoint& b) { return rank(a) < rank(b); });
  Plan plan;
  for (const ReadPoint& next : sorted) {
    const bool joins = !plan.blocks.empty() && plan.queries.back().group == next.point->group &&
                       Joins(plan.blocks.back(), next.address, learned);
    if (!joins) {
      plan.queries.push_back({next.point->group, {}});
      plan.blocks.push_back({next.address, next.address.number.value_or(0)});
    }
    plan.queries.back().points.push_back(next.index);
    plan.blocks.back().last = next.address.number.value_or(0);
  }
  return plan;
}

}  // namespace baudgate::protocols::spabus
