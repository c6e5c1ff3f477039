// `Router` contains the transparent routes of a Modbus server: it passes requests on to lines and
// remote servers, counts each request in the traffic book, and records each request that can write.
// All clients share it, on the server's thread. `RouteTargets` are the lines and servers to which
// routes lead, and `RoutedReport` is the result of a routed request.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/time.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/outputs/modbus/service/route_table.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/records/audit/audited_writes.h"

namespace baudgate::modbus {

// `RouteTargets` contains the targets of transparent routes: the lines (ModbusLinks::lines), and
// the remote servers, which Open creates.
class TrafficBook;
class Upstream;

class RouteTargets {
 public:
  /// A line to which broadcasts are sent, with the deadline of the first route that leads to it.
  struct Line {
    bus::RouteTarget* target = nullptr;
    Duration deadline{};
  };

  /// References must outlive this object. `lines`: the lines by their index in the store.
  RouteTargets(const RouteList& routes, std::span<bus::RouteTarget* const> lines);
  ~RouteTargets();
  RouteTargets(const RouteTargets&) = delete;
  RouteTargets& operator=(const RouteTargets&) = delete;

  /// Open creates the remote servers, one per ServerKey; Close stops them. Both must be called
  /// on the server's thread.
  void Open(asio::io_context& io, const std::shared_ptr<TrafficBook>& book);
  void Close();

  /// Must be called at a reload on the server's thread, after the routes were renewed. `lines` can
  /// have other indices than before. A server to which no route leads any more finishes its
  /// requests and closes.
  void Relink(std::span<bus::RouteTarget* const> lines);

  bus::RouteTarget* of(std::size_t route) const { return targets_[route]; }
  /// Calls RouteTarget::Submit, and notes that the target can have requests of this client. False:
  /// the target has too many requests.
  bool Submit(bus::RouteTarget& target, bus::RoutedRequest request);
  /// Calls RouteTarget::Abandon of every target that can have requests of this client.
  void Abandon(std::uint64_t client);
  /// Returns the name of the target, e.g. "drive" or "10.0.0.9:502", from the first route that
  /// leads to it.
  std::string NameOf(const bus::RouteTarget* target) const;
  std::span<const Line> lines() const { return lines_; }

 private:
  /// Host and port of a remote server, and the paths of the files with which the gateway calls the
  /// server over TLS. Routes with equal keys share one Upstream.
  using ServerKey = std::tuple<std::string, std::uint16_t, config::TlsFiles>;

  void LinkLines(std::span<bus::RouteTarget* const> lines);
  void LinkServers();
  std::unique_ptr<Upstream> MakeServer(const ServerKey& at);
  void CameLate(const ServerKey& server, std::uint8_t slave);

  const RouteList& routes_;
  asio::io_context* io_ = nullptr;  ///< null: Open was not called
  std::shared_ptr<TrafficBook> book_;
  /// Servers are never removed, because clients that have sent requests to them can still call
  /// Abandon.
  std::map<ServerKey, std::unique_ptr<Upstream>> servers_;
  std::vector<bus::RouteTarget*> targets_;  ///< by route number; null: the route has no target
  std::vector<Line> lines_;
  /// For each client: the targets that can still have requests of the client.
  std::map<std::uint64_t, std::vector<bus::RouteTarget*>> asked_;
};

struct RoutedAsk {
  std::size_t route = 0;  ///< the route's number, or TrafficBook::kBroadcasts
  std::uint8_t unit = 0;
  std::string_view peer{};
  bus::RouteTarget* target = nullptr;
  bool has_room = true;  ///< false: the client has too many pending requests
};

// `RoutedReport` is the result of a routed request. gateway/records/event_path.h raises alarms from
// it for slaves that do not answer clients.
struct RoutedReport {
  const config::Route& route;
  std::uint8_t unit = 0;  ///< the unit that the client has addressed
  RouteOutcome end = RouteOutcome::no_reply;
  const bus::RoutedReply& reply;
};

/// Gets a RoutedReport, on the server's thread. The function must return at once.
using OnRoutedReport = std::function<void(const RoutedReport& end, Now now)>;

class Router {
 public:
  /// `lines` and `log` must outlive this object. `log` and `routed` can be null.
  Router(const config::Config& config, std::span<bus::RouteTarget* const> lines,
         audit::WriteLog* log, OnRoutedReport routed, std::shared_ptr<TrafficBook> book);

  void Open(asio::io_context& io) { targets_.Open(io, book_); }
  void Close() { targets_.Close(); }
  /// Applies the configuration of a reload. `routes`: the old index of each route (Origins).
  void Apply(const config::Config& config, std::span<bus::RouteTarget* const> lines,
             const Origins& routes);

  const Way& WayOf(std::uint8_t unit) const { return table_.of(unit); }
  const config::Route& route(std::size_t number) const { return routes_.at(number); }
  bus::RouteTarget* TargetOf(std::size_t route) const { return targets_.of(route); }
  std::span<const RouteTargets::Line> lines() const { return targets_.lines(); }

  /// Passes a request to its target. False: the target or the client has too many requests;
  /// `request.done` is then not called.
  bool Submit(const RoutedAsk& ask, bus::RoutedRequest request, const Now& now);
  /// Counts and records a request that the listener does not permit.
  void Deny(const RoutedAsk& ask, View pdu, const std::string& reason, const Now& now);
  /// Must be called with the reply of a target, except for broadcasts.
  void OnEnd(std::size_t route, std::uint8_t unit, RouteOutcome end, const bus::RoutedReply& reply,
             const Now& now);
  /// Must be called for each pending request whose client no longer waits for it.
  void OnAbandoned(std::size_t route, std::uint8_t unit) {
    book_->Ended(route, unit, RouteOutcome::abandoned, {}, {});
  }
  /// From now on, targets send no more requests of this client.
  void Abandon(std::uint64_t client) { targets_.Abandon(client); }

  /// The traffic book. It is shared, because requests that lines still hold can outlive the server.
  const std::shared_ptr<TrafficBook>& book() const { return book_; }

 private:
  /// Returns a new record of a request that may change its slave. Null: the request cannot, or
  /// there is no log.
  std::shared_ptr<audit::Witness> WitnessOf(const RoutedAsk& ask, View pdu, bool broadcast,
                                            const Now& now) const;

  RouteList routes_;
  RouteTable table_;
  RouteTargets targets_;
  audit::WriteLog* const log_;  ///< null: routed writes are not recorded
  const OnRoutedReport routed_;
  const std::shared_ptr<TrafficBook> book_;
};

}  // namespace baudgate::modbus
