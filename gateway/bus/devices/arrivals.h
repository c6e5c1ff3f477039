// ArrivalTime tells since when bytes that are read now may have been waiting. While bytes are
// awaited, the line looks for them every kLook. If a look is late, the program was stopped or
// starved, or its machine was paused: what is read then may have come at any time since the look
// before. The same holds for what is read directly behind, because one read does not empty a port.
//
//   look before    this look    what is read has come
//   1.0 s          1.1 s        now
//   1.0 s          61.0 s       since 1.0 s
//                  61.4 s       since 1.0 s: it may have waited as well
//                  61.6 s       now
//
// ArrivalTime is a part of gateway/bus/poller/line_inputs.h.
//
// SamplesOf makes readings ready for the store, LatestReadings keeps the points that were read and
// stored last, and EventBacklog counts batches of events that are not on the disk yet, and the
// events that were lost.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "config/model/device.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/point_store.h"
#include "protocols/conversation.h"

namespace baudgate {

class ArrivalTime {
 public:
  /// An input comes; `looks`: bytes were awaited before it.
  void OnInput(Instant now, bool looks) {
    const Instant before = std::exchange(last_, now);
    if (!looks || now - before <= kLook + kLate) return;
    if (now >= held_until_) held_since_ = before;
    held_until_ = now + kHeld;
  }
  /// When the next input is due, while bytes are awaited.
  Instant NextLook() const { return last_ + kLook; }
  /// When bytes that were read at this moment have come at the earliest.
  Instant Earliest(Instant read) const {
    return read >= held_since_ && read < held_until_ ? held_since_ : read;
  }

 private:
  static constexpr Duration kLook = 100ms;
  static constexpr Duration kLate = 100ms;
  static constexpr Duration kHeld = 500ms;

  Instant last_{};
  Instant held_since_{};
  Instant held_until_{};
};

// Readings of a device as the store takes them.

/// Only of its points: other readings are left out.
inline std::vector<Sample> SamplesOf(const config::Device& device,
                                     std::span<const Reading> readings) {
  std::vector<Sample> samples;
  samples.reserve(readings.size());
  for (const Reading& reading : readings) {
    if (reading.point >= device.points.size()) continue;
    samples.push_back(ToSample(device.points[reading.point], reading));
  }
  return samples;
}

inline std::vector<std::uint32_t> PointsOf(std::span<const Sample> samples) {
  std::vector<std::uint32_t> points;
  points.reserve(samples.size());
  for (const Sample& sample : samples) points.push_back(sample.point);
  return points;
}

// The points that were read and stored since the line last rested for its longest reply time. If a
// reply comes twice, one of these readings may belong to another request; which is not known.
class LatestReadings {
 public:
  /// Points of one query of a device.
  struct Points {
    std::size_t device = 0;  ///< its place
    std::vector<std::size_t> points{};
    bool operator==(const Points&) const = default;
  };

  void OnStored(Points read) {
    if (std::ranges::find(read_, read) == read_.end()) read_.push_back(std::move(read));
  }
  /// The line has rested: no reply to an earlier request is owed any more.
  void OnRested() { read_.clear(); }
  std::vector<Points> TakeAll() { return std::exchange(read_, {}); }

 private:
  std::vector<Points> read_;
};

// Events that are not on the disk yet, of a device that sends unasked. It cannot be made to wait,
// so the number of batches is bounded here: events beyond it are lost and counted.
//
//   Take() 1000 times, OnKept() never    true
//   Take()                               false: one is lost
//   OnKept(), Take()                     true; TakeLost(): 1, to be reported with this one
class EventBacklog {
 public:
  static constexpr std::size_t kMost = 1000;

  /// A batch of this many events is to be saved. False: there is no room for it.
  bool Take(std::size_t events) {
    if (waiting_ >= kMost) {
      lost_ += events;
      return false;
    }
    ++waiting_;
    return true;
  }
  /// A batch that was taken is on the disk.
  void OnKept() {
    if (waiting_ > 0) --waiting_;
  }
  /// How many were lost since the last call.
  std::size_t TakeLost() { return std::exchange(lost_, 0); }
  std::size_t waiting() const { return waiting_; }

 private:
  std::size_t waiting_ = 0;  // batches
  std::size_t lost_ = 0;     // events
};

}  // namespace baudgate
