// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/plan.h"

#include <algorithm>
#include <utility>

#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

/// As many bits travel in the bytes of one register.
constexpr std::size_t kBitsForRegister = 16;

std::size_t MostOf(Table table) {
  if (table == Table::file) return kMostOfFile;
  return IsBits(table) ? kMostBits : kMostRegisters;
}

bool MayJoin(const Block<Space>& block, const Block<Space>& next, const Settings& settings) {
  if (!IsAddressed(block.key.table)) return true;  // one request reads all of it
  const bool bits = IsBits(block.key.table);
  const std::size_t most = MostOf(block.key.table);
  const std::size_t size = next.end - block.begin;
  // Overlapping points cannot be parted, unless they become too long.
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

SpacePlan MakePlan(std::span<const config::Point> points,
                   std::span<const std::optional<Place>> places, const Settings& settings,
                   Often is_often) {
  SpacePlan plan(
      {.may_join = [settings](const Block<Space>& block,
                              const Block<Space>& next) { return MayJoin(block, next, settings); },
       .refused = WhenRefused::ask_rarely,
       .is_often = std::move(is_often)});
  for (std::size_t point = 0; point < places.size(); ++point) {
    if (!places[point]) continue;
    plan.Add(points[point].group, point, places[point]->space(), BeginOf(*places[point]),
             EndOf(*places[point]));
  }
  plan.Make();
  return plan;
}

std::vector<Block<Space>> DistinctReads(const SpacePlan& plan) {
  std::vector<Block<Space>> polled;
  for (std::size_t query = 0; query < plan.queries().size(); ++query) {
    if (plan.block(query).key.table <= Table::input) polled.push_back(plan.block(query));
  }
  std::vector<Block<Space>> reads;
  std::vector<Block<Space>> beyond;
  for (const Block<Space>& block : polled) {
    const std::size_t unit = IsBits(block.key.table) ? 8 : 1;  // what makes a reply longer
    std::size_t count = 1;
    const auto is_polled = [&](const Block<Space>& other) {
      return other.key == block.key && (other.size() + unit - 1) / unit == count;
    };
    while (std::ranges::any_of(polled, is_polled)) ++count;
    const std::size_t begin = std::min(block.begin, std::size_t{0x10000} - count * unit);
    const bool inside = count * unit <= block.size();
    (inside ? reads : beyond).push_back({block.key, begin, begin + count * unit, 1});
  }
  reads.insert(reads.end(), beyond.begin(), beyond.end());
  return reads;
}

}  // namespace baudgate::protocols::modbus
