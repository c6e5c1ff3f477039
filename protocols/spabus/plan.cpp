// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/plan.h"

#include <algorithm>
#include <utility>

namespace baudgate::protocols::spabus {
namespace {

bool AreNeighbours(std::uint32_t a, std::uint32_t b) { return a + 1 == b || b + 1 == a; }

/// Whether its neighbours stand in other channels: 1I1, 2I1, 3I1. Neighbours of its own channel go
/// before, and channel 0 is no channel among others: it holds what is common to all.
bool IsAcross(const ReadPoint& point, std::span<const ReadPoint> points) {
  const Address& own = point.address;
  if (!own.number || own.channel == 0) return false;
  const auto shares = [&](const ReadPoint& other) {
    return other.address.category == own.category && other.address.number &&
           other.point->group == point.point->group;
  };
  const bool in_channel = std::ranges::any_of(points, [&](const ReadPoint& other) {
    return shares(other) && other.address.channel == own.channel &&
           AreNeighbours(*other.address.number, *own.number);
  });
  return !in_channel && std::ranges::any_of(points, [&](const ReadPoint& other) {
    return shares(other) && other.address.number == own.number && other.address.channel != 0 &&
           AreNeighbours(other.address.channel, own.channel);
  });
}

}  // namespace

ItemPlan MakePlan(std::span<const ReadPoint> points, const RequestLimits& limits, Often is_often) {
  ItemPlan plan({.may_join =
                     [&limits](const Block<Row>& block, const Block<Row>& next) {
                       return next.begin == block.end && block.size() < limits.items &&
                              (limits.channels || !block.key.across);
                     },
                 .refused = WhenRefused::ask_daily,
                 .refusals = 3,
                 .is_often = std::move(is_often)});
  for (const ReadPoint& point : points) {
    const Address& address = point.address;
    const std::uint32_t number = address.number.value_or(0);
    const bool across = IsAcross(point, points);
    const std::size_t place = across ? address.channel : number;
    plan.Add(point.point->group, point.index,
             {address.category, across, across ? number : address.channel}, place, place + 1);
  }
  plan.Make();
  return plan;
}

Command ReadOf(unsigned slave, const Block<Row>& block) {
  const auto [category, across, common] = block.key;
  const Range places{static_cast<std::uint32_t>(block.begin),
                     static_cast<std::uint32_t>(block.end - 1)};
  const Range same{common, common};
  Command command;
  command.slave = slave;
  command.category = category;
  command.channels = across ? places : same;
  if (TakesNumber(category)) command.numbers = across ? same : places;
  return command;
}

}  // namespace baudgate::protocols::spabus
