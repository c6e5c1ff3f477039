// What all clients of a Modbus server share: the map, the way to the values, the lines and the
// routes, the private copy and the counters. Requests come from request_service.cpp; values from
// the point store; writes go to the command sink. Used by the server's own thread only, the
// counters' snapshot excepted.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/modbus/registers/register_contents.h"
#include "gateway/modbus/registers/register_image.h"
#include "gateway/modbus/registers/register_map.h"
#include "gateway/modbus/registers/responder.h"
#include "gateway/modbus/service/ack_register.h"
#include "gateway/modbus/service/inbox.h"
#include "gateway/modbus/service/links.h"
#include "gateway/modbus/service/route_list.h"
#include "gateway/modbus/service/route_table.h"
#include "gateway/modbus/service/route_targets.h"
#include "gateway/modbus/service/traffic_book.h"
#include "gateway/modbus/wire/request.h"
#include "gateway/requests/write_command.h"
#include "gateway/store/point_store.h"
#include "gateway/writes/write_gate.h"

namespace baudgate::modbus {

/// Limits that are no configuration; tests shorten them.
struct ModbusLimits {
  Duration write_deadline = 5s;  ///< a write that is not confirmed by then is answered 0x0B
  Duration stall = 10s;          ///< a client that leaves its answers unread so long is closed
  double client_share = 1;       ///< of each listener's max_clients
};

struct LiveCounters {
  std::atomic<std::uint64_t> clients = 0;
  std::atomic<std::uint64_t> accepted = 0;
  std::atomic<std::uint64_t> refused = 0;
  std::atomic<std::uint64_t> malformed = 0;
  std::atomic<std::uint64_t> idle = 0;
  std::atomic<std::uint64_t> stalled = 0;
  std::atomic<std::uint64_t> accept_errors = 0;
  std::atomic<std::uint64_t> requests = 0;
  std::atomic<std::uint64_t> exceptions = 0;

  ModbusCounters Snapshot() const;
  /// One thread writes, so no locked instruction is needed.
  static void Add(std::atomic<std::uint64_t>& counter) {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
};

class PointService {
 public:
  using Done = std::function<void(const WriteResult&)>;

  PointService(const config::Config& config, const PointStore& store, CommandSink& sink,
               std::function<GatewayFigures()> info, ModbusLimits limits,
               const ModbusLinks& links = {});

  /// A reload. Clients and what they wait for stay. `routes`: which are the same.
  void Apply(const config::Config& config, std::span<RouteTarget* const> lines,
             const Origins& routes);
  /// See ModbusLimits; of clients that connect from now on.
  void SetClientShare(double share) { limits_.client_share = share; }

  /// Unit, function, counts and lengths; fills `request` when there is no
  /// exception.
  ExceptionCode Check(View frame, ModbusRequest& request) const;
  /// Fills responder() for the answer. Never waits for a line or the disk. `client`: the number of
  /// its Writer, whose place among the events is its own.
  ExceptionCode Read(const ModbusRequest& request, Holes holes, Instant now,
                     std::uint64_t client = 0);
  /// By the register: queues a write to points, selects a point, acknowledges alarms, or sets which
  /// events are shown first. A write is not begun once `dropped` is true; `done` is called once, on
  /// any thread, unless there is an exception.
  ExceptionCode Submit(const ModbusRequest& request, const Writer& writer, Instant now,
                       std::shared_ptr<const std::atomic<bool>> dropped, Done done);
  /// Another part has refused this write: its points are recorded with that end.
  void Deny(View frame, const Writer& writer, const WriteResult& refused, const Now& now);
  /// The client has left.
  void Forget(const Writer& writer);
  /// How a write ended, as Modbus says it.
  static ExceptionCode ExceptionOf(const WriteResult& result);
  /// Why it was not begun.
  static ExceptionCode ExceptionOf(const WriteRefusal& refusal);

  const Way& WayOf(std::uint8_t unit) const { return table_.of(unit); }
  const config::Route& route(std::size_t number) const { return routes_.at(number); }
  RouteTargets& targets() { return targets_; }
  /// Which framings are spoken.
  const Frames& frames() const { return frames_; }
  /// Null: routed writes are not recorded.
  audit::WriteLog* audit() const { return audit_; }
  /// A request of a client has ended, other than a broadcast.
  void OnRouted(const RoutedReport& end, const Now& now) const {
    if (routed_) routed_(end, now);
  }

  Responder& responder() { return responder_; }
  LiveCounters& counters() { return counters_; }
  const LiveCounters& counters() const { return counters_; }
  const ModbusLimits& limits() const { return limits_; }
  const std::shared_ptr<Inbox>& inbox() const { return inbox_; }
  /// Shared by what may outlive the server.
  const std::shared_ptr<TrafficBook>& book() const { return book_; }

 private:
  void MakeImages();
  /// From the unit's image, if that has the whole request and is fresh or may be made again.
  std::optional<ExceptionCode> ReadImage(const ModbusRequest& request, Instant now);
  ExceptionCode ReadRecord(const ModbusRequest& request, const UnitMap& unit, Instant now);
  ExceptionCode ReadGateway(const ModbusRequest& request);
  void FillEvents(const ModbusRequest& request, const UnitMap& unit, std::uint64_t client);

  const PointStore& store_;
  WriteGate gate_;
  std::function<GatewayFigures()> info_;
  ModbusLimits limits_;
  RegisterMap map_;
  RouteList routes_;
  RouteTable table_;
  RouteTargets targets_;
  Frames frames_;
  audit::WriteLog* audit_;
  const OnRoutedReport routed_;
  std::shared_ptr<const events::EventFeed> events_;  ///< null: none are kept
  AckRegister acks_;
  /// The first event that a client wants to see of a unit; none: the newest.
  std::map<std::pair<std::uint64_t, std::uint8_t>, std::uint32_t> first_events_;
  std::shared_ptr<TrafficBook> book_;
  std::array<std::unique_ptr<RegisterImage>, 256> images_;  ///< by unit; none where no device is
  Responder responder_;
  LiveCounters counters_;
  std::shared_ptr<Inbox> inbox_ = std::make_shared<Inbox>();
  std::vector<Piece> pieces_;  ///< of the request in hand; kept for its memory
};

}  // namespace baudgate::modbus
