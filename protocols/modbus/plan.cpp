// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/plan.h"

#include <algorithm>
#include <tuple>

#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

/// As many bits travel in the bytes of one register.
constexpr std::size_t kBitsForRegister = 16;

}  // namespace

Plan::Plan(std::span<const config::Point> points, const Settings& settings)
    : points_(points), most_registers_(settings.block), hole_(settings.hole) {
  places_.reserve(points.size());
  for (const config::Point& point : points) {
    places_.emplace_back();
    if (point.access == config::Access::write) continue;
    if (auto place = ReadPlace(point)) places_.back() = std::move(*place);
  }
  Make();
}

void Plan::Make() {
  queries_.clear();
  blocks_.clear();
  std::vector<std::size_t> order;
  for (std::size_t point = 0; point < places_.size(); ++point) {
    if (places_[point]) order.push_back(point);
  }
  const auto group_of = [this](std::size_t point) {
    const config::Group group = points_[point].group;
    const bool rarely = demoted_.contains(point) && group == config::Group::fast;
    return rarely ? config::Group::slow : group;
  };
  const auto key = [&](std::size_t point) {
    const Place& place = *places_[point];
    return std::tuple(group_of(point), place.table, BatchOf(point), place.address, place.end(),
                      point);
  };
  std::ranges::sort(order, {}, key);
  for (const std::size_t point : order) {
    const Place& place = *places_[point];
    const bool joins = !queries_.empty() && queries_.back().group == group_of(point) &&
                       BatchOf(queries_.back().points.front()) == BatchOf(point) &&
                       MayJoin(blocks_.back(), point);
    if (!joins) {
      queries_.push_back({group_of(point), {}});
      blocks_.push_back({place.table, place.address, 0});
    }
    Block& block = blocks_.back();
    block.count = std::max(block.end(), place.end()) - block.address;
    queries_.back().points.push_back(point);
  }
}

/// 0 while the device answers it.
std::size_t Plan::BatchOf(std::size_t point) const {
  const auto found = demoted_.find(point);
  return found == demoted_.end() ? 0 : found->second;
}

bool Plan::MayJoin(const Block& block, std::size_t point) const {
  const Place& place = *places_[point];
  if (place.table != block.table) return false;
  if (block.Covers(place)) return true;
  if (place.address < block.end()) {
    // Overlapping points can not be parted, unless they become too long.
    return place.end() - block.address <= (IsBits(place.table) ? kMostBits : kMostRegisters);
  }
  if (IsCutBetween(block, place.address)) return false;
  const std::size_t scale = IsBits(place.table) ? kBitsForRegister : 1;
  const std::size_t most =
      std::min(most_registers_ * scale, IsBits(place.table) ? kMostBits : kMostRegisters);
  return place.address - block.end() <= hole_ * scale && place.end() - block.address <= most;
}

bool Plan::IsCutBetween(const Block& block, std::size_t address) const {
  const auto cut = cuts_.lower_bound({block.table, std::size_t{block.address} + 1});
  return cut != cuts_.end() && cut->first == block.table && cut->second <= address;
}

bool Plan::Split(std::size_t query) {
  const Block& block = blocks_[query];
  // Where a point begins and all before it have ended: the widest hole, else the middle.
  std::vector<std::size_t> places;
  std::size_t widest = 0;
  std::size_t at = 0;
  std::size_t end = block.address;
  for (const std::size_t point : queries_[query].points) {
    const Place& place = *places_[point];
    if (place.address >= end && place.address > block.address) {
      places.push_back(place.address);
      if (place.address - end > widest) {
        widest = place.address - end;
        at = place.address;
      }
    }
    end = std::max(end, place.end());
  }
  if (places.empty()) return false;
  if (widest == 0) at = places[places.size() / 2];
  cuts_.insert({block.table, at});
  Make();
  return true;
}

bool Plan::Demote(std::size_t query) {
  const std::vector<std::size_t> points = queries_[query].points;
  if (demoted_.contains(points.front())) return false;
  ++batches_;
  for (const std::size_t point : points) demoted_.emplace(point, batches_);
  Make();
  return true;
}

bool Plan::Restore(std::size_t query) {
  const std::vector<std::size_t> points = queries_[query].points;
  if (!demoted_.contains(points.front())) return false;
  for (const std::size_t point : points) demoted_.erase(point);
  Make();
  return true;
}

void Plan::Forget() {
  if (demoted_.empty()) return;
  demoted_.clear();
  Make();
}

}  // namespace baudgate::protocols::modbus
