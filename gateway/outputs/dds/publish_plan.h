// Decides what the DDS publisher sends and when: change beyond the deadband, change of quality,
// heartbeat. Pure: values and time come in as arguments; gateway/outputs/dds/publisher.h acts
// on it. DueQueue finds what is due next.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/device_status.h"

namespace baudgate::dds {

// Which of many numbered things is due next: an indexed heap in which putting something off, the
// common case, costs one store. Pure; used by PublishPlan for points and devices.
class DueQueue {
 public:
  /// Slots 0…count-1, all due at `first`.
  DueQueue(std::size_t count, Instant first);

  /// Earlier takes O(log n) at once; later is noted and settled when the old time comes.
  void Set(std::uint32_t slot, Instant due);
  Instant due(std::uint32_t slot) const { return due_[slot]; }

  /// A slot whose time has come, if any. It stays in the queue: Set it to its next time.
  std::optional<std::uint32_t> Due(Instant now);
  /// Not later than the next due time; Instant::max() when there are no slots.
  Instant Next() const;

 private:
  void SiftUp(std::size_t at);
  void SiftDown(std::size_t at);
  bool Before(std::size_t a, std::size_t b) const { return key_[heap_[a]] < key_[heap_[b]]; }
  void Swap(std::size_t a, std::size_t b);

  std::vector<Instant> due_;             ///< by slot
  std::vector<Instant> key_;             ///< by slot: what the heap is ordered by; never after due_
  std::vector<std::uint32_t> heap_;      ///< slots
  std::vector<std::uint32_t> position_;  ///< by slot: where it stands in heap_
};

struct PlanOptions {
  Duration heartbeat = 10s;       ///< each point and device is sent at least so often
  Duration device_interval = 1s;  ///< counters of a device are sent at most so often
  Duration retry = 1s;            ///< after a write that failed
};

/// A text, and the digits of a whole number beyond 2^53, which a double would round; else empty.
std::string TextOf(const Value& value);

/// What of a point decides whether it is sent; small enough to keep one for every point.
struct PointState {
  double number = 0;
  std::size_t text_hash = 0;
  Quality quality = Quality::bad_waiting;

  static PointState Of(const Value& value, Quality quality);
};

/// Points are numbered through all devices ("slot"). Everything is due at the start: that is the
/// start-up image. Memory is fixed; no call allocates or looks at all points.
class PublishPlan {
 public:
  PublishPlan(const PlanOptions& options, std::vector<double> deadbands, std::size_t devices,
              Instant start);

  /// A point may have changed: send it?
  bool WantsPoint(std::uint32_t slot, const PointState& state) const;
  void PointSent(std::uint32_t slot, const PointState& state, Instant now);
  /// Whether subscribers have ever been told of it, so that they have to be told of its end.
  bool WasSent(std::uint32_t slot) const { return points_[slot].was_sent; }
  bool DeviceWasSent(std::uint32_t device) const { return devices_[device].was_sent; }
  /// By a plan before this one.
  void MarkSent(std::uint32_t slot) { points_[slot].was_sent = true; }
  /// All that the plan before this one, of the same points and devices, has sent.
  void KeepMarks(const PublishPlan& before);
  /// It is tried again after `retry`, or when it changes.
  void PointFailed(std::uint32_t slot, Instant now);

  /// A device has changed: send its status? When not yet, it becomes due by itself later.
  bool WantsDevice(std::uint32_t device, bus::DeviceState state, Instant now);
  void DeviceSent(std::uint32_t device, bus::DeviceState state, Instant now);
  void DeviceFailed(std::uint32_t device, Instant now);
  /// It is in the plan for its number alone.
  void DeviceGone(std::uint32_t device) { due_devices_.Set(device, Instant::max()); }

  /// At most `most` points whose heartbeat (or first sending, or retry) is due; WantsPoint says yes
  /// to them until they are sent.
  void TakeDuePoints(Instant now, std::size_t most, std::vector<std::uint32_t>& slots);
  void TakeDueDevices(Instant now, std::size_t most, std::vector<std::uint32_t>& devices);
  /// When to look for due ones again.
  Instant NextDue() const;

 private:
  struct Point {
    double deadband = 0;
    PointState sent;
    bool forced = true;
    bool was_sent = false;
  };
  struct Device {
    Instant sent_at = Instant::min();
    bus::DeviceState sent = bus::DeviceState::never_seen;
    bool forced = true;
    bool was_sent = false;
  };

  Duration Period(std::uint32_t slot) const;

  PlanOptions options_;
  std::vector<Point> points_;
  std::vector<Device> devices_;
  DueQueue due_points_;
  DueQueue due_devices_;
};

}  // namespace baudgate::dds
