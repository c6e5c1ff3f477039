// `PointSlots` numbers the points of all devices of a store consecutively; such a number is called
// a slot. FillPoint and FillDevice fill samples. PointEnds and DeviceEnds are queues of final
// samples of points and devices that a reload has removed.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/publish_plan.h"
#include "gateway/outputs/dds/sample_writer.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

class PointSlots {
 public:
  explicit PointSlots(const bus::PointStore& store);

  std::uint32_t size() const { return first_.back(); }
  std::uint32_t devices() const { return static_cast<std::uint32_t>(first_.size()) - 1; }
  bool Has(std::uint32_t device) const { return held_[device] != nullptr; }
  std::uint32_t SlotOf(bus::PointRef ref) const { return first_[ref.device] + ref.point; }
  bus::PointRef RefOf(std::uint32_t slot) const;
  /// Returns the device's handle from PointStore::Hold; null: the store did not contain the device.
  const std::shared_ptr<const void>& HoldOf(std::uint32_t device) const { return held_[device]; }

 private:
  /// The handle of each device, by its index. While the handle exists, the store keeps the device's
  /// record for the final samples. Null: the store did not contain the device.
  std::vector<std::shared_ptr<const void>> held_;
  /// The first slot of each device, by its index; the last element is the number of slots.
  std::vector<std::uint32_t> first_;
};

Room CountOf(const bus::PointStore& store);
/// Returns CountOf(store) and a reserve for points and devices that reloads add.
Room RoomFor(const bus::PointStore& store);

/// Returns "device.point". The caller must hold the device (PointStore::Hold).
std::string NameOf(const bus::PointStore& store, bus::PointRef ref);
/// Returns the deadband of each slot.
std::vector<double> DeadbandsBySlot(const bus::PointStore& store, const PointSlots& slots);

// FillPoint and FillDevice set all fields of a sample except the gateway's name.

/// Fills `sample` from the point; the number and the quality are those of `state`.
void FillPoint(const bus::DeviceRecord& record, std::uint32_t point, const PointState& state,
               PointSample& sample);
void FillDevice(const bus::DeviceRecord& record, DeviceSample& sample);

// The queue of final samples of points that a reload has removed: each point is published once more
// with its last value and quality "not connected".
class PointEnds {
 public:
  /// The references must outlive this object.
  PointEnds(const config::Config& config, const bus::PointStore& store)
      : config_(config), store_(store) {}

  /// `held` is the device's handle from PointStore::Hold.
  void Add(bus::PointRef ref, std::shared_ptr<const void> held) {
    gone_.push_back({ref, std::move(held)});
  }
  void Clear() { gone_.clear(); }
  /// Removes the points that exist again under the same name from the queue. Returns their slots.
  std::vector<std::uint32_t> TakeBack(const PointSlots& slots);

  bool empty() const { return gone_.empty(); }
  /// Returns the sample to send next; null: there is no sample to send. Returns the same sample
  /// until OnSent.
  const PointSample* Next();
  void OnSent() { gone_.pop_front(); }

 private:
  const config::Config& config_;
  const bus::PointStore& store_;
  struct Gone {
    bus::PointRef ref;
    std::shared_ptr<const void> held;
  };
  std::deque<Gone> gone_;
  PointSample sample_;
};

/// The queue of final samples of devices that a reload has removed: each device is published once
/// more with its last counters and state `disabled`.
class DeviceEnds {
 public:
  /// The references must outlive this object.
  DeviceEnds(const config::Config& config, const bus::PointStore& store)
      : config_(config), store_(store) {}

  void Add(std::uint32_t device, std::shared_ptr<const void> held) {
    gone_.push_back({device, std::move(held)});
  }
  void Clear() { gone_.clear(); }
  /// Removes the devices from the queue whose name is in use again, e.g. because a reload has
  /// restarted their line.
  void TakeBack();

  bool empty() const { return gone_.empty(); }
  /// Returns the sample to send next; null: there is no sample to send. Returns the same sample
  /// until OnSent.
  const DeviceSample* Next();
  void OnSent() { gone_.pop_front(); }

 private:
  const config::Config& config_;
  const bus::PointStore& store_;
  struct Gone {
    std::uint32_t device = 0;
    std::shared_ptr<const void> held;
  };
  std::deque<Gone> gone_;
  DeviceSample sample_;
};

}  // namespace baudgate::dds
