// The narrow way from the point store to an output: which points and devices have changed since the
// output last looked. Coalescing: a slow output sees the latest state of each, never a backlog, and
// memory is bounded by the number of points. Filled by line threads, drained by the output's
// thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <span>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/time.h"

namespace baudgate {

struct PointRef {
  std::uint32_t device = 0;  ///< index in the point store
  std::uint32_t point = 0;   ///< index in the device's points
};

struct Changes {
  std::vector<PointRef> points;
  std::vector<std::uint32_t> devices;  ///< whose state or counters changed

  bool empty() const { return points.empty() && devices.empty(); }
};

class ChangeFeed {
 public:
  /// points_per_device[d] is the number of points of device d.
  explicit ChangeFeed(std::span<const std::size_t> points_per_device);

  /// One more device.
  void AddDevice(std::size_t points);

  void MarkPoints(std::uint32_t device, std::span<const std::uint32_t> points);
  void MarkDevice(std::uint32_t device);

  /// Takes all that is pending into `out` (which is cleared first). Waits for the first change, at
  /// most until the given time. Also returns, possibly empty, after Wake.
  void Drain(Instant until, Changes& out);
  /// Ends a waiting Drain at once, for an orderly stop.
  void Wake();

 private:
  Mutex mutex_;
  std::condition_variable changed_;
  Changes pending_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<std::vector<bool>> point_pending_ BAUDGATE_GUARDED_BY(mutex_);
  std::vector<bool> device_pending_ BAUDGATE_GUARDED_BY(mutex_);
  bool woken_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

}  // namespace baudgate
