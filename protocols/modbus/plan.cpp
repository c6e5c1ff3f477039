// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/plan.h"

#include <algorithm>

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
                   std::span<const std::optional<Place>> places, const Settings& settings) {
  SpacePlan plan(
      {.may_join = [settings](const Block<Space>& block,
                              const Block<Space>& next) { return MayJoin(block, next, settings); },
       .refused = WhenRefused::ask_rarely,
       .keeps_splits = true});
  for (std::size_t point = 0; point < places.size(); ++point) {
    if (!places[point]) continue;
    plan.Add(points[point].group, point, places[point]->space(), BeginOf(*places[point]),
             EndOf(*places[point]));
  }
  plan.Make();
  return plan;
}

std::optional<Block<Space>> DistinctRead(const SpacePlan& plan) {
  const std::size_t queries = plan.queries().size();
  std::size_t of_table = 0;
  while (of_table < queries && plan.block(of_table).key.table > Table::input) ++of_table;
  if (of_table == queries) return std::nullopt;
  const Block<Space>& first = plan.block(of_table);
  const std::size_t unit = IsBits(first.key.table) ? 8 : 1;  // what makes a reply longer
  const auto units = [unit](std::size_t size) { return (size + unit - 1) / unit; };
  const auto is_polled = [&](std::size_t wanted) {
    for (std::size_t query = 0; query < queries; ++query) {
      const Block<Space>& block = plan.block(query);
      if (block.key == first.key && units(block.size()) == wanted) return true;
    }
    return false;
  };
  std::size_t count = 1;
  while (is_polled(count)) ++count;
  const std::size_t begin = std::min(first.begin, std::size_t{0x10000} - count * unit);
  return Block<Space>{first.key, begin, begin + count * unit, 1};
}

}  // namespace baudgate::protocols::modbus
