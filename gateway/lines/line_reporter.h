// What one line reports: device states and warnings to the log, news and events to the event sink,
// what conversations have learned to their memory. The beginning and the end of a lasting state are
// reported once each; an end without a beginning is reported the first time only (News::first).
//
//   device online → offline           no_answer
//   port lost, opened                 port_down, port_down over
//   that device offline → online      no_answer over; of all others only the first (News::first)
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "config/model/line.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/lines/event_sink.h"
#include "gateway/records/disk/device_memory.h"
#include "gateway/records/trace/line_recorder.h"

namespace baudgate {

/// On the line's thread, but Retire.
class LineReporter final : public PollerListener {
 public:
  /// All outlive it. `memory` null: what conversations learn ends with the program. `events` null:
  /// nothing is kept.
  LineReporter(const config::Line& line, const PointStore& store, const LineRecorder& recorder,
               DeviceMemory* memory, EventSink* events)
      : line_(line), store_(store), recorder_(recorder), memory_(memory), events_(events) {}

  void OnDeviceState(std::uint32_t device, DeviceState from, DeviceState to,
                     const std::string& reason, Now at) override;
  void OnWarning(std::uint32_t device, const std::string& message) override;
  void OnMemory(std::uint32_t device, const std::string& memory) override {
    if (memory_ != nullptr) memory_->Set(device, memory);
  }
  void OnEvents(ReportedEvents events) override {
    unsaved_.insert(events.device);
    if (events_ != nullptr) events_->OnReported(std::move(events));
  }
  void OnDrained(std::uint32_t device, Instant asked) override {
    if (events_ != nullptr) events_->OnDrained(device, asked);
  }
  void OnNews(News news, Now at) override;
  void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) override {
    if (events_ != nullptr) events_->OnRead(device, points, at);
  }

  /// A reload has put another line in the place of this one, whose driver hangs: news from now on
  /// would pass for that line's, which has the same name. From any thread.
  void Retire() { retired_ = true; }

  /// Events of the device are on the disk: those that OnEvents reported last (`reported`), or those
  /// from before the start. Returns whether none of its events is unsaved.
  [[nodiscard]] bool TakeKept(std::uint32_t device, bool reported) {
    if (reported) unsaved_.erase(device);
    return !unsaved_.contains(device);
  }

 private:
  using Key = std::pair<News::What, std::optional<std::uint32_t>>;

  void TellState(std::uint32_t device, DeviceState from, DeviceState to, const std::string& reason,
                 Now at);

  const config::Line& line_;
  const PointStore& store_;
  const LineRecorder& recorder_;
  DeviceMemory* const memory_;
  EventSink* const events_;
  std::atomic<bool> retired_ = false;
  std::set<std::uint32_t> unsaved_;  // devices whose events are not on the disk yet
  std::set<Key> lasting_;            // told, and not over
  std::set<Key> over_;               // their end was told once
};

}  // namespace baudgate
