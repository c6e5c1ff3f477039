// All lines of the gateway and the threads that they run on. Lines are numbered for good: one that
// a reload ends keeps its number, a new one gets the next.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/points/steady_vector.h"
#include "gateway/lines/line_slot.h"
#include "gateway/lines/loop_watch.h"
#include "gateway/records/trace/recordings.h"
#include "transports/loop_thread.h"

namespace baudgate {

class Lines {
 public:
  /// For the first attempt of new lines to open what they need.
  static constexpr Duration kWaitForPorts = 1s;
  /// For lines to end: a second for a write under way (line_port.cpp), and some room.
  static constexpr Duration kWaitForLines = 1300ms;

  /// `loops`: the number of threads for lines that never block (placement.h), at least one. All
  /// references outlive it; lines have the numbers of the store.
  Lines(PointStore& store, const config::Catalog& catalog, std::size_t loops);
  ~Lines();
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;

  /// What lines are joined with that are added from now on; it outlives them.
  void Link(LineParts::Links links) { links_ = std::move(links); }
  /// A thread of its own for a line whose driver may block; null: it needs none. The error: the
  /// system has no thread or no file descriptors left for it.
  static Result<std::shared_ptr<LoopThread>> MakeLoop(const config::Line& line);
  /// The next of the store's lines, on this thread of its own or, without one, on a thread that it
  /// shares. It does not run before Start.
  void Add(std::shared_ptr<const config::Line> line, std::shared_ptr<LoopThread> own = {});
  /// Those that do not run yet.
  void Start();
  /// A text for each port that these lines, which were just started, could not open: "line bay: no
  /// client can come in at 127.0.0.1:4001: address already in use". Waits for the first attempts,
  /// at most kWaitForPorts. Connections of lines over the network take longer and are not reported.
  std::vector<std::string> NotOpen(std::span<const std::uint32_t> lines) const;
  /// Ends these lines and closes their ports, within about a second. A line whose driver does not
  /// return from a call is abandoned.
  void Remove(std::span<const std::uint32_t> lines);
  /// Ends all, within about a second. Returns the names of those that hang.
  std::vector<std::string> Stop();
  /// Ends all, and waits for every driver.
  void End();
  /// After End: nothing runs any more.
  void StopLoops();

  std::size_t size() const { return places_.size(); }
  /// Empty as well while a reload has put the line into the store and not yet here.
  LineSlot& at(std::uint32_t line) const {
    return line < places_.size() ? places_[line].slot : none_;
  }
  const config::Line& config(std::uint32_t line) const { return *places_[line].config; }
  LineSlot& OfDevice(std::uint32_t device) const {
    return device < line_of_.size() ? at(line_of_[device]) : none_;
  }
  /// Never blocks, and runs as long as any line.
  asio::io_context& io() { return shared_.front()->io(); }
  std::size_t present() const;
  std::size_t open() const;
  std::optional<WallTime> stuck_since(std::uint32_t line) const;
  void OnHostClock(bool right);

  /// Another loop to be watched, which outlives this.
  void Watch(const std::string& name, asio::io_context& io);
  /// Reports loops that hang; called once a second. False: one that the whole gateway needs hangs.
  bool Look(WallTime now);

 private:
  struct Place {
    explicit Place(std::shared_ptr<const config::Line> its) : config(std::move(its)) {}
    const std::shared_ptr<const config::Line> config;
    std::shared_ptr<LoopThread> own{};  // null: it shares one
    LineSlot slot;
    bool started = false;
  };
  void OnLoop(const LoopWatch::Change& change);
  asio::io_context& LoopFor(Place& place);
  std::vector<LineRunner*> All() const;

  PointStore& store_;
  const Poller::FindProtocol find_;
  LineParts::Links links_;
  std::vector<std::unique_ptr<LoopThread>> shared_;
  bool running_ = false;
  std::size_t turn_ = 0;  // of the shared loops
  SteadyVector<Place> places_;
  SteadyVector<std::uint32_t> line_of_;               // by device
  mutable LineSlot none_;                             // always empty
  std::vector<std::unique_ptr<LineRunner>> hanging_;  // their loops stay, too
  Mutex watch_mutex_;
  LoopWatch watch_ BAUDGATE_GUARDED_BY(watch_mutex_);
  Mutex clock_mutex_;
  std::optional<bool> clock_right_ BAUDGATE_GUARDED_BY(clock_mutex_);  // as told last
};

}  // namespace baudgate
