// The points of a store, numbered one after the other: the slots of
// gateway/outputs/dds/publish_plan.h. Those of devices that are gone have none.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "gateway/bus/points/change_feed.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

class PointSlots {
 public:
  explicit PointSlots(const PointStore& store);

  std::uint32_t size() const { return first_.back(); }
  /// Devices that the store had when the points were numbered.
  std::uint32_t devices() const { return static_cast<std::uint32_t>(first_.size()) - 1; }
  /// It was in the store then.
  bool Has(std::uint32_t device) const { return there_[device]; }
  std::uint32_t SlotOf(PointRef ref) const { return first_[ref.device] + ref.point; }
  PointRef RefOf(std::uint32_t slot) const;

 private:
  std::vector<bool> there_;           ///< by device
  std::vector<std::uint32_t> first_;  ///< by device, and one more: the number of points
};

/// What `store` has now.
Room CountOf(const PointStore& store);
/// The same with some to spare for what reloads add.
Room RoomFor(const PointStore& store);

/// "device.point"
std::string NameOf(const PointStore& store, PointRef ref);
/// By that name.
std::unordered_map<std::string, std::uint32_t> SlotsByName(const PointStore& store,
                                                           const PointSlots& slots);
std::vector<double> DeadbandsBySlot(const PointStore& store, const PointSlots& slots);

}  // namespace baudgate::dds
