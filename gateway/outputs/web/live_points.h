// Streams of points (server-sent events): at first how all stands, then what changes, five times a
// second at most, and a beat each second. A frame is made once for all viewers of the same points,
// and none without a viewer. One thread, except the streams that it gives out.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/web/frames.h"
#include "gateway/outputs/web/request.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::web {

class LivePoints {
 public:
  static constexpr Duration kTick = 200ms;
  static constexpr Duration kBeat = 1s;
  static constexpr std::size_t kMostKinds = 32;  ///< all points, or those of one device

  /// `events`: null: there are no alarms. Both outlive it.
  LivePoints(PointStore& store, const events::EventSource* events)
      : store_(store), events_(events) {}
  ~LivePoints() { Drop(); }

  /// One more viewer, of all or of a device. Null: too many different devices are looked at.
  std::shared_ptr<Stream> Join(std::optional<std::uint32_t> device, Now now);
  /// Call it each kTick while there is a viewer. False: there is none any more.
  bool Tick(Now now);
  bool watched() const { return !channels_.empty(); }
  /// A reload: the points have other numbers. All streams end.
  void EndAll();

 private:
  class Viewer;
  using Device = std::optional<std::uint32_t>;
  struct Channel {
    std::shared_ptr<Frames> frames = std::make_shared<Frames>();
    std::vector<std::weak_ptr<Viewer>> viewers;
  };
  struct AlarmCounts {
    std::size_t active = 0;
    std::size_t unacknowledged = 0;
    std::int64_t newest = 0;
    bool operator==(const AlarmCounts&) const = default;
  };

  void Drop();
  std::string Snapshot(Device device, Now now);
  std::string Changed(Device device, Now now);
  std::string AlarmsEvent() const;
  AlarmCounts CountAlarms() const;
  void Wake(Channel& channel);

  PointStore& store_;
  const events::EventSource* events_;
  std::shared_ptr<ChangeFeed> feed_;  // null: no client looks
  Changes changes_;
  std::map<Device, Channel> channels_;
  AlarmCounts alarms_;
  Instant next_beat_{};
  std::uint64_t generation_ = 1;
};

}  // namespace baudgate::web
