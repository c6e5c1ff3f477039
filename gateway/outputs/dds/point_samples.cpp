// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/point_samples.h"

#include <algorithm>
#include <functional>
#include <string>
#include <unordered_map>
#include <unordered_set>

namespace baudgate::dds {
namespace {

std::unordered_map<std::string, std::uint32_t> SlotsByName(const bus::PointStore& store,
                                                           const PointSlots& slots) {
  std::unordered_map<std::string, std::uint32_t> by_name;
  for (std::uint32_t slot = 0; slot < slots.size(); ++slot) {
    by_name[NameOf(store, slots.RefOf(slot))] = slot;
  }
  return by_name;
}

}  // namespace

PointSlots::PointSlots(const bus::PointStore& store) : first_{0} {
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    held_.push_back(store.gone(device) ? nullptr : store.Hold(device));
    const std::size_t points = held_.back() ? store.point_count(device) : 0;
    first_.push_back(first_.back() + static_cast<std::uint32_t>(points));
  }
}

bus::PointRef PointSlots::RefOf(std::uint32_t slot) const {
  const auto after = std::ranges::upper_bound(first_, slot);
  const auto device = static_cast<std::uint32_t>(after - first_.begin()) - 1;
  return {device, slot - first_[device]};
}

Room CountOf(const bus::PointStore& store) {
  Room room;
  room.events = 1;  // the gateway, which has alarms and events of its own
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    const auto its = store.device(device);
    if (store.gone(device) || !its) continue;
    room.points += static_cast<std::uint32_t>(its->points.size());
    ++room.devices;
    if (its->events || its->point_events) ++room.events;
  }
  return room;
}

Room RoomFor(const bus::PointStore& store) {
  constexpr std::uint32_t kSpare = 512;
  Room room = CountOf(store);
  room.points += room.points / 4 + kSpare;
  room.devices += room.devices / 4 + kSpare / 8;
  return room;
}

std::string NameOf(const bus::PointStore& store, bus::PointRef ref) {
  const auto device = store.device(ref.device);
  return device->name + "." + device->points[ref.point].name;
}

std::vector<double> DeadbandsBySlot(const bus::PointStore& store, const PointSlots& slots) {
  std::vector<double> deadbands;
  deadbands.reserve(slots.size());
  for (std::uint32_t slot = 0; slot < slots.size(); ++slot) {
    const bus::PointRef ref = slots.RefOf(slot);
    deadbands.push_back(store.device(ref.device)->points[ref.point].deadband.ToDouble());
  }
  return deadbands;
}

namespace {

std::uint32_t Microseconds(Duration duration) {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(duration / 1us, 0, UINT32_MAX));
}

}  // namespace

void FillPoint(const bus::DeviceRecord& record, std::uint32_t point, const PointState& state,
               PointSample& sample) {
  const bus::PointRecord& held = record.points[point];
  const config::Point& described = record.device->points[point];
  sample.device = record.device->name;
  sample.point = described.name;
  sample.value = state.number;
  AssignBounded(sample.text, TextOf(held.value), kMaxText);
  AssignBounded(sample.unit, described.unit, kMaxUnit);
  sample.quality = state.quality.word();
  sample.source_time_ns = held.read_at ? held.source_time.time_since_epoch().count() : 0;
  sample.seq = held.seq;
  sample.rtt_us = held.rtt_us;
}

void FillDevice(const bus::DeviceRecord& record, DeviceSample& sample) {
  const bus::DeviceStatus& status = record.status;
  sample.device = record.device->name;
  sample.line = record.line->name;
  sample.state = static_cast<std::uint16_t>(status.state);
  sample.last_outcome = static_cast<std::uint16_t>(status.last_outcome);
  sample.last_ok_time_ns = status.last_ok ? status.last_ok_wall.time_since_epoch().count() : 0;
  sample.exchanges = status.exchanges;
  sample.ok = status.Count(Outcome::ok);
  sample.no_reply = status.Count(Outcome::no_reply);
  sample.corrupt = status.Count(Outcome::corrupt);
  sample.retries = status.retries;
  const bool measured = status.round_trips.count() > 0;
  sample.rtt_mean_us = measured ? Microseconds(status.round_trips.mean()) : 0;
  sample.rtt_p99_us = measured ? Microseconds(status.round_trips.Percentile(0.99)) : 0;
}

std::vector<std::uint32_t> PointEnds::TakeBack(const PointSlots& slots) {
  std::vector<std::uint32_t> back;
  const auto by_name = SlotsByName(store_, slots);
  std::erase_if(gone_, [&](const Gone& gone) {
    const auto found = by_name.find(NameOf(store_, gone.ref));
    if (found != by_name.end()) back.push_back(found->second);
    return found != by_name.end();
  });
  return back;
}

const PointSample* PointEnds::Next() {
  if (gone_.empty()) return nullptr;
  const bus::PointRef ref = gone_.front().ref;
  sample_ = {};
  sample_.gateway = config_.name;
  const auto look = [&](const bus::DeviceRecord& record) {
    const Value& value = record.points[ref.point].value;
    FillPoint(record, ref.point, PointState::Of(value, Quality::bad_not_connected), sample_);
  };
  store_.Read(ref.device, std::cref(look));
  return &sample_;
}

void DeviceEnds::TakeBack() {
  std::unordered_set<std::string> there;
  for (std::uint32_t device = 0; device < store_.device_count(); ++device) {
    const auto its = store_.device(device);
    if (its && !store_.gone(device)) there.insert(its->name);
  }
  std::erase_if(gone_,
                [&](const Gone& gone) { return there.contains(store_.device(gone.device)->name); });
}

const DeviceSample* DeviceEnds::Next() {
  if (gone_.empty()) return nullptr;
  sample_ = {};
  sample_.gateway = config_.name;
  const auto look = [this](const bus::DeviceRecord& record) { FillDevice(record, sample_); };
  store_.Read(gone_.front().device, std::cref(look));
  sample_.state = static_cast<std::uint16_t>(bus::DeviceState::disabled);
  return &sample_;
}

}  // namespace baudgate::dds
