// `PublishPlan` decides which points the DDS publisher sends and when: after a change beyond the
// deadband, a change of quality, or as a heartbeat. No I/O: values and time are arguments. DueQueue
// finds the next slot that is due.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/points/device_status.h"

namespace baudgate::dds {

// DueQueue is a priority queue of slots by due time: an indexed heap in which delaying a slot, the
// most frequent call, writes only one number.
class DueQueue {
 public:
  /// Contains the slots 0…count-1, all due at `first`.
  DueQueue(std::size_t count, Instant first);

  /// Sets the due time of a slot. An earlier time than before costs O(log n) at once; a later time
  /// is only stored, and the heap is corrected when the earlier time is reached.
  void Set(std::uint32_t slot, Instant due);
  Instant due(std::uint32_t slot) const { return due_[slot]; }

  /// Returns a slot that is due, if there is one. The slot stays in the queue until Set moves it.
  std::optional<std::uint32_t> Due(Instant now);
  /// Returns a time that is not later than the next due time; Instant::max() if there are no slots.
  Instant Next() const;

 private:
  void SiftUp(std::size_t at);
  void SiftDown(std::size_t at);
  bool Before(std::size_t a, std::size_t b) const { return key_[heap_[a]] < key_[heap_[b]]; }
  void Swap(std::size_t a, std::size_t b);

  std::vector<Instant> due_;
  std::vector<Instant> key_;  ///< the time by which the heap sorts each slot; never later than due_
  std::vector<std::uint32_t> heap_;
  std::vector<std::uint32_t> position_;  ///< index of each slot in heap_
};

struct PlanOptions {
  Duration heartbeat = 10s;       ///< each point and device is sent at least once in this time
  Duration device_interval = 1s;  ///< counters of a device are sent at most once in this time
  Duration retry = 1s;            ///< pause after a write that failed
};

/// Returns the value as text if a double cannot represent it: a text, or the digits of a whole
/// number beyond 2^53; else an empty text.
std::string TextOf(const Value& value);

/// The part of a point's value that decides whether the point is sent. It is small, because every
/// point has one.
struct PointState {
  double number = 0;
  std::size_t text_hash = 0;
  Quality quality = Quality::bad_waiting;

  static PointState Of(const Value& value, Quality quality);
};

/// PublishPlan decides for each point (by slot) and device whether it is sent. At `start`
/// everything is due. The memory is fixed, and no call walks through all points except KeepMarks.
class PublishPlan {
 public:
  PublishPlan(const PlanOptions& options, std::vector<double> deadbands, std::size_t devices,
              Instant start);

  bool WantsPoint(std::uint32_t slot, const PointState& state) const;
  void PointSent(std::uint32_t slot, const PointState& state, Instant now);
  /// True if the point was ever sent, so that its removal must be published.
  bool WasSent(std::uint32_t slot) const { return points_[slot].was_sent; }
  bool DeviceWasSent(std::uint32_t device) const { return devices_[device].was_sent; }
  /// Makes WasSent true for a point that was sent before a reload, so that its removal will be
  /// published.
  void MarkSent(std::uint32_t slot) { points_[slot].was_sent = true; }
  /// Copies the WasSent marks of a previous plan for the same points and devices.
  void KeepMarks(const PublishPlan& before);
  /// To be called when a point could not be sent: it is tried again after `retry`, or when it
  /// changes.
  void PointFailed(std::uint32_t slot, Instant now);

  /// True if the status of a changed device is to be sent now. If device_interval has not passed,
  /// the device becomes due when it has.
  bool WantsDevice(std::uint32_t device, bus::DeviceState state, Instant now);
  void DeviceSent(std::uint32_t device, bus::DeviceState state, Instant now);
  void DeviceFailed(std::uint32_t device, Instant now);
  /// To be called when the device was removed: it keeps its number and is never due.
  void DeviceGone(std::uint32_t device) { due_devices_.Set(device, Instant::max()); }

  /// Returns in `slots` at most `most` points that are due for a heartbeat, their first sample or a
  /// retry. WantsPoint returns true for them until they are sent.
  void TakeDuePoints(Instant now, std::size_t most, std::vector<std::uint32_t>& slots);
  void TakeDueDevices(Instant now, std::size_t most, std::vector<std::uint32_t>& devices);
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
