// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/change_feed.h"

namespace baudgate {

ChangeFeed::ChangeFeed(std::span<const std::size_t> points_per_device)
    : device_pending_(points_per_device.size(), false) {
  point_pending_.reserve(points_per_device.size());
  for (const std::size_t count : points_per_device) point_pending_.emplace_back(count, false);
}

void ChangeFeed::AddDevice(std::size_t points) {
  const MutexLock lock(mutex_);
  point_pending_.emplace_back(points, false);
  device_pending_.push_back(false);
}

void ChangeFeed::MarkPoints(std::uint32_t device, std::span<const std::uint32_t> points) {
  {
    const MutexLock lock(mutex_);
    std::vector<bool>& pending = point_pending_[device];
    for (const std::uint32_t point : points) {
      if (pending[point]) continue;
      pending[point] = true;
      pending_.points.push_back({device, point});
    }
  }
  changed_.notify_one();
}

void ChangeFeed::MarkDevice(std::uint32_t device) {
  {
    const MutexLock lock(mutex_);
    if (device_pending_[device]) return;
    device_pending_[device] = true;
    pending_.devices.push_back(device);
  }
  changed_.notify_one();
}

void ChangeFeed::Drain(Instant until, Changes& out) {
  out.points.clear();
  out.devices.clear();
  MutexLock lock(mutex_);
  while (!woken_ && pending_.empty() && lock.WaitUntil(changed_, until)) {
  }
  woken_ = false;
  std::swap(out, pending_);
  for (const PointRef& ref : out.points) point_pending_[ref.device][ref.point] = false;
  for (const std::uint32_t device : out.devices) device_pending_[device] = false;
}

void ChangeFeed::Wake() {
  {
    const MutexLock lock(mutex_);
    woken_ = true;
  }
  changed_.notify_one();
}

}  // namespace baudgate
