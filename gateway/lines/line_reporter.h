// What one line reports: device states and warnings to the log, news and events to the event sink,
// what conversations have learned to their memory. The beginning and the end of a lasting state are
// reported once each; an end without a beginning is reported the first time only (News::first).
//
//   device online → offline           no_answer
//   port lost, opened                 port_down, port_down over
//   that device offline → online      no_answer over; of all others only the first (News::first)
//
// PortDisplay shows the port of the line.
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

/// On the line's thread, but Retire.
class LineReporter final : public bus::PollerListener {
 public:
  /// All outlive it. `memory` null: what conversations learn ends with the program. `events` null:
  /// nothing is kept.
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
  std::set<Key> lasting_;            // told, and not over
  std::set<Key> over_;               // their end was told once
};

// What people see of a line's port: the log, the status, the trace and the news.

/// A loan of the port, as people see it.
struct ShownLoan {
  WallTime until{};
  bool to_client = false;  ///< over the network; else by hand to another program
};

class PortDisplay {
 public:
  /// All outlive it.
  PortDisplay(bus::PointStore& store, const config::Line& line, records::LineRecorder& recorder,
              LineReporter& reporter);

  /// `text`: what the port is and how it is set.
  void OnOpened(const std::string& text, Now now);
  struct Down {
    bool first = false;   ///< for this reason, since it worked
    bool silent = false;  ///< closed here, because no device behind it has answered
  };
  void OnDown(const std::string& reason, Down down, Now now);
  /// By hand: the write under way ends first. The epoch: it was called off.
  void OnReleaseAsked(WallTime until);
  /// By hand, to another program.
  void OnReleased(const std::string& port, Duration time, Now now);
  /// The loan is over. The port may have gone meanwhile, so it is not open yet.
  void OnTakenBack(Now now);
  void CountLoss(Now now, bool takes_no_data = false);
  /// The connection has proven that it works.
  void OnWorked() { worked_ = true; }
  /// There is no connection; the first time behind one that has worked counts.
  void CountNoConnection(transports::NoConnection why, Now now);
  void OnConnected(Now now) { connected_ = now.instant; }
  /// The server has ended a connection.
  struct End {
    bool worked = false;  ///< something was answered over it
    bool asked = false;   ///< a request was not answered yet
    bool unread = false;  ///< nor read
  };
  void CountEnd(End end, Now now);
  /// The server has ended a connection that was in use, which is no outage.
  void CountDrop(const std::string& reason, Now now);
  /// It has ended one as it does again and again, which is no trouble.
  void CountRest();

  void Show(bus::LineStatus::Port port, const std::string& text, Now now, ShownLoan loan = {});
  template <typename Change>
  void Update(Change change) {
    store_.UpdateLine(line_, change);
  }
  const std::string& text() const { return text_; }

 private:
  bus::PointStore& store_;
  const std::uint32_t line_;  // its number in the store
  const std::string name_;
  records::LineRecorder& recorder_;
  LineReporter& reporter_;
  std::string text_;
  Instant connected_{};
  bool worked_ = false;  // the last connection, and no try has failed since
};

}  // namespace baudgate::lines
