// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/plan.h"

#include <algorithm>

#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

/// As many bits travel in the bytes of one register.
constexpr std::size_t kBitsForRegister = 16;

bool MayJoin(const Block<Table>& block, const Block<Table>& next, const Settings& settings) {
  const bool bits = IsBits(block.key);
  const std::size_t most = bits ? kMostBits : kMostRegisters;
  const std::size_t size = next.end - block.begin;
  // Overlapping points can not be parted, unless they become too long.
  if (next.begin < block.end) return size <= most;
  const std::size_t scale = bits ? kBitsForRegister : 1;
  return next.begin - block.end <= settings.hole * scale &&
         size <= std::min(settings.block * scale, most);
}

}  // namespace

std::vector<std::optional<Place>> ReadPlaces(std::span<const config::Point> points) {
  std::vector<std::optional<Place>> places;
  places.reserve(points.size());
  for (const config::Point& point : points) {
    places.emplace_back();
    if (point.access == config::Access::write) continue;
    if (auto place = ReadPlace(point)) places.back() = std::move(*place);
  }
  return places;
}

TablePlan MakePlan(std::span<const config::Point> points,
                   std::span<const std::optional<Place>> places, const Settings& settings) {
  TablePlan plan(
      {.may_join = [settings](const Block<Table>& block,
                              const Block<Table>& next) { return MayJoin(block, next, settings); },
       .refused = WhenRefused::ask_rarely,
       .keeps_splits = true});
  for (std::size_t point = 0; point < places.size(); ++point) {
    if (!places[point]) continue;
    plan.Add(points[point].group, point, places[point]->table, places[point]->address,
             places[point]->end());
  }
  plan.Make();
  return plan;
}

Block<Table> DistinctRead(const TablePlan& plan) {
  const Block<Table>& first = plan.block(0);
  const std::size_t unit = IsBits(first.key) ? 8 : 1;  // what makes a reply longer
  const auto units = [unit](std::size_t size) { return (size + unit - 1) / unit; };
  const auto is_polled = [&](std::size_t wanted) {
    for (std::size_t query = 0; query < plan.queries().size(); ++query) {
      const Block<Table>& block = plan.block(query);
      if (block.key == first.key && units(block.size()) == wanted) return true;
    }
    return false;
  };
  std::size_t count = 1;
  while (is_polled(count)) ++count;
  const std::size_t begin = std::min(first.begin, std::size_t{0x10000} - count * unit);
  return {first.key, begin, begin + count * unit, 1};
}

Bytes ReadOf(const Block<Table>& block) {
  return ReadRequest(ReadFunction(block.key), static_cast<std::uint16_t>(block.begin),
                     block.size());
}

}  // namespace baudgate::protocols::modbus
