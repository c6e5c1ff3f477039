// The final samples of points and devices that a reload has removed. Each point is published once
// more with its last value, not connected; each device with its last counters, disabled. No I/O:
// gateway/outputs/dds/notice_sender.h sends them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "config/model/config.h"
#include "gateway/bus/points/change_feed.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/dds/point_slots.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

class PointEnds {
 public:
  /// Both outlive this.
  PointEnds(const config::Config& config, const PointStore& store)
      : config_(config), store_(store) {}

  void Add(PointRef ref) { gone_.push_back(ref); }
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
  const PointStore& store_;
  std::deque<PointRef> gone_;
  PointSample sample_;  ///< of the first
};

/// The queue of removed devices.
class DeviceEnds {
 public:
  /// Both outlive this.
  DeviceEnds(const config::Config& config, const PointStore& store)
      : config_(config), store_(store) {}

  /// `device`: its number in the store, which keeps the counters of removed devices.
  void Add(std::uint32_t device) { gone_.push_back(device); }
  void Clear() { gone_.clear(); }
  /// Drops devices whose name is still in use: a reload may have begun their line anew.
  void TakeBack();

  bool empty() const { return gone_.empty(); }
  /// As PointEnds::Next.
  const DeviceSample* Next();
  void OnSent() { gone_.pop_front(); }

 private:
  const config::Config& config_;
  const PointStore& store_;
  std::deque<std::uint32_t> gone_;
  DeviceSample sample_;
};

}  // namespace baudgate::dds
