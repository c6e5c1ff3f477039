// `Frames` contains the frames for all viewers of the same points; each frame is made once and
// shared. A viewer has no queue, only the number of its next frame. If that frame has already been
// deleted, the viewer is too slow and gets a snapshot. `LivePoints` streams points, and `LiveTrace`
// streams the bytes of a line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/diagnosis/decode/exchange_decoder.h"
#include "gateway/outputs/web/request.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/trace/trace_text.h"

namespace baudgate::web {

class Frames {
 public:
  using Text = std::shared_ptr<const std::string>;
  static constexpr std::size_t kMostFrames = 25;
  static constexpr std::size_t kMostBytes = 4 * 1024 * 1024;

  void Push(std::string text);
  /// Sets the snapshot: a frame with the present state, which replaces all earlier frames.
  void SetSnapshot(std::string text);
  void End(std::string farewell);
  bool wants_snapshot() const;

  struct Next {
    Text text{};  ///< null: there is no new frame yet
    bool ended = false;
  };
  /// Returns a viewer's next frame. `position` belongs to the viewer; its first value is 0.
  Next Take(std::uint64_t& position);

 private:
  mutable Mutex mutex_;
  std::deque<Text> frames_ BAUDGATE_GUARDED_BY(mutex_);
  std::size_t bytes_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  std::uint64_t first_ BAUDGATE_GUARDED_BY(mutex_) = 1;  ///< number of the frame frames_.front()
  Text snapshot_ BAUDGATE_GUARDED_BY(mutex_);
  /// The number of the first frame that the snapshot does not include.
  std::uint64_t after_snapshot_ BAUDGATE_GUARDED_BY(mutex_) = 0;
  bool wanted_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool ended_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

// `LivePoints` streams points as server-sent events: first a snapshot, then changes at most five
// times a second, and a heartbeat each second. A frame is made once for all viewers of the same
// points, and only if there is a viewer. One thread uses LivePoints; another thread can read its
// streams.
class LivePoints {
 public:
  static constexpr Duration kTick = 200ms;
  static constexpr Duration kBeat = 1s;
  /// The most channels: one for all points, and one for each device that is viewed.
  static constexpr std::size_t kMostKinds = 32;

  /// `store` and `events` must outlive this object. `events` null: there are no alarms.
  LivePoints(bus::PointStore& store, const events::EventSource* events)
      : store_(store), events_(events) {}
  ~LivePoints() { Drop(); }

  /// Adds a viewer of all points, or of one device's points. Null: too many different devices are
  /// viewed.
  std::shared_ptr<Stream> Join(std::optional<std::uint32_t> device, Now now);
  /// Sends changes and heartbeats. Must be called each kTick while there is a viewer. False: there
  /// is no viewer any more.
  bool Tick(Now now);
  bool watched() const { return !channels_.empty(); }
  /// Ends all streams. Must be called at a reload, because points then get other numbers.
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

  bus::PointStore& store_;
  const events::EventSource* events_;
  std::shared_ptr<bus::ChangeFeed> feed_;  // null: there is no viewer
  bus::Changes changes_;
  std::map<Device, Channel> channels_;
  AlarmCounts alarms_;
  Instant next_beat_{};
  std::uint64_t generation_ = 1;
};

// `LiveTrace` streams the frames of a line's trace as server-sent events.
class LiveTrace final : public Stream {
 public:
  explicit LiveTrace(diagnosis::Decoders decoders) : frames_(std::move(decoders)) {}
  /// Sets the queue of the trace records. Must be called before the first Read.
  void SetQueue(std::shared_ptr<records::TraceQueue> queue) { queue_ = std::move(queue); }

  std::ptrdiff_t Read(std::span<char> into) override;
  void SetWake(std::function<void()> wake) override;

  // Any thread may call the following functions.

  void Wake();
  /// Sends a heartbeat, so that a client that has left is detected.
  void Beat();
  void End();

 private:
  void Append(const std::vector<std::string>& frames);

  std::shared_ptr<records::TraceQueue> queue_;
  diagnosis::FrameLines frames_;
  std::string text_;
  std::size_t sent_ = 0;
  std::atomic<bool> beat_ = false;
  std::atomic<bool> ended_ = false;
  Mutex mutex_;
  std::function<void()> wake_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::web
