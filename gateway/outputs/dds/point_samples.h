// The points of a store, numbered one after the other: the slots of
// gateway/outputs/dds/publish_plan.h. Those of devices that are gone have none. FillPoint and
// FillDevice fill samples, and PointEnds and DeviceEnds keep the final samples.
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
  /// Devices that the store had when the points were numbered.
  std::uint32_t devices() const { return static_cast<std::uint32_t>(first_.size()) - 1; }
  /// It was in the store then.
  bool Has(std::uint32_t device) const { return held_[device] != nullptr; }
  std::uint32_t SlotOf(bus::PointRef ref) const { return first_[ref.device] + ref.point; }
  bus::PointRef RefOf(std::uint32_t slot) const;
  /// What the store knew of the device stays as long.
  const std::shared_ptr<const void>& HoldOf(std::uint32_t device) const { return held_[device]; }

 private:
  /// By device; null: it was not in the store. Keeps what subscribers are told at its end.
  std::vector<std::shared_ptr<const void>> held_;
  std::vector<std::uint32_t> first_;  ///< by device, and one more: the number of points
};

/// What `store` has now.
Room CountOf(const bus::PointStore& store);
/// The same with some to spare for what reloads add.
Room RoomFor(const bus::PointStore& store);

/// "device.point" of a device that is held.
std::string NameOf(const bus::PointStore& store, bus::PointRef ref);
/// Of `slots`, which hold their devices.
std::vector<double> DeadbandsBySlot(const bus::PointStore& store, const PointSlots& slots);

// From the point store into the samples of points and devices: all fields but the gateway's name.

/// `state`: of the point's value, at its quality now.
void FillPoint(const bus::DeviceRecord& record, std::uint32_t point, const PointState& state,
               PointSample& sample);
void FillDevice(const bus::DeviceRecord& record, DeviceSample& sample);

// The final samples of points and devices that a reload has removed. Each point is published once
// more with its last value, not connected; each device with its last counters, disabled. No I/O:
// gateway/outputs/dds/notice_sender.h sends them.
class PointEnds {
 public:
  /// Both outlive this.
  PointEnds(const config::Config& config, const bus::PointStore& store)
      : config_(config), store_(store) {}

  /// `held`: see PointStore::Hold.
  void Add(bus::PointRef ref, std::shared_ptr<const void> held) {
    gone_.push_back({ref, std::move(held)});
  }
  void Clear() { gone_.clear(); }
  /// A point that has come back under its name before its end was told has none. Returns the slots
  /// of these points.
  std::vector<std::uint32_t> TakeBack(const PointSlots& slots);

  bool empty() const { return gone_.empty(); }
  /// The one to be sent; null: none now. The same until OnSent.
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
  PointSample sample_;  ///< of the first
};

/// The queue of removed devices.
class DeviceEnds {
 public:
  /// Both outlive this.
  DeviceEnds(const config::Config& config, const bus::PointStore& store)
      : config_(config), store_(store) {}

  /// `held`: see PointStore::Hold.
  void Add(std::uint32_t device, std::shared_ptr<const void> held) {
    gone_.push_back({device, std::move(held)});
  }
  void Clear() { gone_.clear(); }
  /// Drops devices whose name is still in use: a reload may have begun their line anew.
  void TakeBack();

  bool empty() const { return gone_.empty(); }
  /// As PointEnds::Next.
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
