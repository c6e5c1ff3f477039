// `LineReporter` reports what happens on one line: device states and warnings to the log, news and
// events to the event sink, and what conversations have learned to records::DeviceMemory. The
// beginning and the end of a lasting state are reported once each; an end without a beginning is
// reported the first time only (News::first).
//
//   device online → offline           no_answer
//   port lost                         port_down
//   port opened                       port_down over
//   this device offline → online      no_answer over
//   another device → online           no_answer over, the first time only (News::first)
//
// `PortDisplay` shows the port of the line in log, status, trace and news.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "config/model/line.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/records/disk/device_memory.h"
#include "gateway/records/trace/line_recorder.h"
#include "transports/transport.h"

namespace baudgate::lines {

/// All functions must be called on the line's thread, except Retire.
class LineReporter final : public bus::PollerListener {
 public:
  /// The references and pointers must outlive this object. `memory` null: what conversations learn
  /// is lost at the end of the program. `events` null: events are dropped.
  LineReporter(const config::Line& line, const bus::PointStore& store,
               const records::LineRecorder& recorder, records::DeviceMemory* memory,
               bus::EventSink* events)
      : line_(line), store_(store), recorder_(recorder), memory_(memory), events_(events) {}

  void OnDeviceState(std::uint32_t device, bus::DeviceState from, bus::DeviceState to,
                     const std::string& reason, Now at) override;
  void OnWarning(std::uint32_t device, const std::string& message) override;
  void OnMemory(std::uint32_t device, const std::string& memory) override {
    if (memory_ != nullptr) memory_->Set(device, memory);
  }
  void OnEvents(bus::ReportedEvents events) override {
    unsaved_.insert(events.device);
    if (events_ != nullptr) events_->OnReported(std::move(events));
  }
  void OnDrained(std::uint32_t device, Instant asked) override {
    if (events_ != nullptr) events_->OnDrained(device, asked);
  }
  void OnNews(bus::News news, Now at) override;
  void OnRead(std::uint32_t device, std::span<const std::uint32_t> points, Now at) override {
    if (events_ != nullptr) events_->OnRead(device, points, at);
  }

  /// Stops news. A reload calls this for a line whose driver hangs, when a new line with its name
  /// has replaced it: users would take its news for news of the new line. Thread-safe.
  void Retire() { retired_ = true; }

  /// Notes that events of the device have been saved to the disk. `reported`: true for the events
  /// of the last OnEvents call; false for events that were on the disk before the start. Returns
  /// true if no event of the device is unsaved.
  [[nodiscard]] bool TakeKept(std::uint32_t device, bool reported) {
    if (reported) unsaved_.erase(device);
    return !unsaved_.contains(device);
  }

 private:
  using Key = std::pair<bus::News::What, std::optional<std::uint32_t>>;

  void TellState(std::uint32_t device, bus::DeviceState from, bus::DeviceState to,
                 const std::string& reason, Now at);

  const config::Line& line_;
  const bus::PointStore& store_;
  const records::LineRecorder& recorder_;
  records::DeviceMemory* const memory_;
  bus::EventSink* const events_;
  std::atomic<bool> retired_ = false;
  std::set<std::uint32_t> unsaved_;  // devices whose events are not on the disk yet
  std::set<Key> lasting_;            // states whose beginning was reported, and whose end was not
  std::set<Key> over_;               // states whose end was reported before
};

struct ShownLoan {
  WallTime until{};
  bool to_client = false;  ///< true: lent to a network client; false: to another program
};

class PortDisplay {
 public:
  /// The references must outlive this object.
  PortDisplay(bus::PointStore& store, const config::Line& line, records::LineRecorder& recorder,
              LineReporter& reporter);

  void OnOpened(const std::string& text, Now now);
  struct Down {
    bool first = false;  ///< the first failure for this reason since the port worked
    /// This gateway has closed the port, because no device behind it has answered.
    bool silent = false;
  };
  void OnDown(const std::string& reason, Down down, Now now);
  /// Shows that a user has asked for a release until `until`, which waits for the end of the
  /// current write. If `until` is the epoch: shows that the release was called off.
  void OnReleaseAsked(WallTime until);
  void OnReleased(const std::string& port, Duration time, Now now);
  /// Called when the release is over, before the first attempt to open the port again.
  void OnTakenBack(Now now);
  void CountLoss(Now now, bool takes_no_data = false);
  void OnWorked() { worked_ = true; }
  /// Counts a connection that could not be opened, if the last connection worked and this is the
  /// first failure since.
  void CountNoConnection(transports::NoConnection why, Now now);
  void OnConnected(Now now) { connected_ = now.instant; }
  struct End {
    bool worked = false;  ///< true: an answer came over the connection
    bool asked = false;   ///< true: no byte has come since the last request
    bool unread = false;  ///< true: the server had not read the last request
  };
  void CountEnd(End end, Now now);
  /// Counts and logs the end of a connection in use (RestingConnection::IsDrop); this is no outage.
  void CountDrop(const std::string& reason, Now now);
  /// Counts that the server has ended a connection and that the next request will open a new one.
  /// This is not a fault.
  void CountRest();

  void Show(bus::LineStatus::Port port, const std::string& text, Now now, ShownLoan loan = {});
  template <typename Change>
  void Update(Change change) {
    store_.UpdateLine(line_, change);
  }
  const std::string& text() const { return text_; }

 private:
  bus::PointStore& store_;
  const std::uint32_t line_;
  const std::string name_;
  records::LineRecorder& recorder_;
  LineReporter& reporter_;
  std::string text_;
  Instant connected_{};
  bool worked_ = false;  // the last connection worked, and no attempt has failed since
};

}  // namespace baudgate::lines
