// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/point_slots.h"

#include <algorithm>

namespace baudgate::dds {

PointSlots::PointSlots(const PointStore& store) : first_{0} {
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    const std::size_t points = store.gone(device) ? 0 : store.device(device).points.size();
    there_.push_back(!store.gone(device));
    first_.push_back(first_.back() + static_cast<std::uint32_t>(points));
  }
}

PointRef PointSlots::RefOf(std::uint32_t slot) const {
  const auto after = std::ranges::upper_bound(first_, slot);
  const auto device = static_cast<std::uint32_t>(after - first_.begin()) - 1;
  return {device, slot - first_[device]};
}

Room CountOf(const PointStore& store) {
  Room room;
  room.events = 1;  // the gateway has some itself, at least alarms
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    if (store.gone(device)) continue;
    const config::Device& its = store.device(device);
    room.points += static_cast<std::uint32_t>(its.points.size());
    ++room.devices;
    if (its.events || its.point_events) ++room.events;
  }
  return room;
}

Room RoomFor(const PointStore& store) {
  constexpr std::uint32_t kSpare = 512;
  Room room = CountOf(store);
  room.points += room.points / 4 + kSpare;
  room.devices += room.devices / 4 + kSpare / 8;
  return room;
}

std::string NameOf(const PointStore& store, PointRef ref) {
  const config::Device& device = store.device(ref.device);
  return device.name + "." + device.points[ref.point].name;
}

std::unordered_map<std::string, std::uint32_t> SlotsByName(const PointStore& store,
                                                           const PointSlots& slots) {
  std::unordered_map<std::string, std::uint32_t> by_name;
  for (std::uint32_t slot = 0; slot < slots.size(); ++slot) {
    by_name[NameOf(store, slots.RefOf(slot))] = slot;
  }
  return by_name;
}

std::vector<double> DeadbandsBySlot(const PointStore& store, const PointSlots& slots) {
  std::vector<double> deadbands;
  deadbands.reserve(slots.size());
  for (std::uint32_t slot = 0; slot < slots.size(); ++slot) {
    const PointRef ref = slots.RefOf(slot);
    deadbands.push_back(store.device(ref.device).points[ref.point].deadband.ToDouble());
  }
  return deadbands;
}

}  // namespace baudgate::dds
