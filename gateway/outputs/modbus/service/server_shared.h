// The parts that all clients of a Modbus server share: units, routes, the traffic book, the way
// back to the server's thread, limits and counters. Only the book and the snapshot of the counters
// are used by other threads too. Inbox is the way back to the thread, and ModbusLinks is what the
// composition root hands to the server.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/service/own_units.h"
#include "gateway/outputs/modbus/service/router.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/outputs/modbus/wire/client_framing.h"

namespace baudgate::modbus {

// The way from a line's thread to the Modbus server's: how a write or a routed request ended. It
// may outlive the server, because lines answer when they can; what comes after Close is dropped.
class Inbox {
 public:
  using Clocks = std::function<Now()>;

  /// `clocks` tells each task when it runs.
  void Open(asio::io_context& io, Clocks clocks) {
    const MutexLock lock(mutex_);
    io_ = &io;
    clocks_ = std::move(clocks);
  }
  void Close() {
    const MutexLock lock(mutex_);
    io_ = nullptr;
  }
  /// From any thread. `task` takes a `const Now&`.
  template <typename Task>
  void Post(Task task) {
    const MutexLock lock(mutex_);
    if (io_ == nullptr) return;
    asio::post(*io_, [task = std::move(task), clocks = clocks_]() mutable { task(clocks()); });
  }

 private:
  Mutex mutex_;
  asio::io_context* io_ BAUDGATE_GUARDED_BY(mutex_) = nullptr;
  Clocks clocks_ BAUDGATE_GUARDED_BY(mutex_);
};

/// Limits that are no configuration; tests shorten them.
struct ModbusLimits {
  Duration write_deadline =
      kWaitForDevice;       ///< a write that is not confirmed by then is answered 0x0B
  Duration stall = 10s;     ///< a client that leaves its answers unread so long is closed
  double client_share = 1;  ///< of each listener's max_clients
};

/// What routes, RTU clients, events and alarms need beside the store; all of it outlives the
/// server.
struct ModbusLinks {
  std::vector<RouteTarget*> lines;  ///< by index in config.lines; empty when no route leads to one
  Frames frames{};                  ///< of clients that speak as on a serial line
  /// Of routed writes and acknowledgements; null: they are not recorded.
  audit::WriteLog* writes = nullptr;
  std::shared_ptr<const events::EventFeed> events{};  ///< null: none are kept
  events::EventSource* alarms = nullptr;              ///< to be acknowledged; null: likewise
  OnRoutedReport routed{};                            ///< may be null
};

class ServerShared {
 public:
  ServerShared(const config::Config& config, const PointStore& store, CommandSink& sink,
               std::function<GatewayFigures()> info, ModbusLimits limits,
               const ModbusLinks& links = {});

  /// A reload. Clients and what they wait for stay. `routes`: which are the same.
  void Apply(const config::Config& config, std::span<RouteTarget* const> lines,
             const Origins& routes);
  /// See ModbusLimits; of clients that connect from now on.
  void SetClientShare(double share) { limits_.client_share = share; }

  /// Answers of lines and servers come in from now on. `clocks` tells each when it comes.
  void Open(asio::io_context& io, Inbox::Clocks clocks);
  /// None comes in any more.
  void CloseInbox() { inbox_->Close(); }
  /// The servers elsewhere are left.
  void CloseRoutes() { router_.Close(); }

  /// The error: why nothing can be answered.
  Status Ready() { return units_.responder().ready(); }
  OwnUnits& units() { return units_; }
  Router& router() { return router_; }
  /// Which framings are spoken.
  const Frames& frames() const { return frames_; }

  LiveCounters& counters() { return counters_; }
  const LiveCounters& counters() const { return counters_; }
  const ModbusLimits& limits() const { return limits_; }
  const std::shared_ptr<Inbox>& inbox() const { return inbox_; }
  /// Shared by what may outlive the server.
  const std::shared_ptr<TrafficBook>& book() const { return book_; }

 private:
  ModbusLimits limits_;
  const std::shared_ptr<TrafficBook> book_ = std::make_shared<TrafficBook>();
  LiveCounters counters_;
  OwnUnits units_;
  Router router_;
  Frames frames_;
  const std::shared_ptr<Inbox> inbox_ = std::make_shared<Inbox>();
};

}  // namespace baudgate::modbus
