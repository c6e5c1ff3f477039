// The transparent routes of a Modbus server: which unit goes where, and what is kept of each
// request that is passed on: its count in the traffic book and, if it may write, its record. Shared
// by all clients. On the server's thread. RouteTargets are the lines and servers where routes lead,
// and RoutedReport is the result of a request that was passed on.
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
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/time.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/outputs/modbus/service/route_table.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/records/audit/audited_writes.h"

namespace baudgate::modbus {

// Where transparent routes lead: the lines that the composition root has given, and the servers
// elsewhere that are made here. Asked by Router for every routed request.
class TrafficBook;
class Upstream;

class RouteTargets {
 public:
  /// A line that broadcasts go to, with the deadline of the first route that leads to it.
  struct Line {
    bus::RouteTarget* target = nullptr;
    Duration deadline{};
  };

  /// All outlive this. `lines`: by the numbers of the store.
  RouteTargets(const RouteList& routes, std::span<bus::RouteTarget* const> lines);
  ~RouteTargets();
  RouteTargets(const RouteTargets&) = delete;
  RouteTargets& operator=(const RouteTargets&) = delete;

  /// Makes the servers elsewhere, one per host and port. Both on the server's thread.
  void Open(asio::io_context& io, const std::shared_ptr<TrafficBook>& book);
  void Close();

  /// A reload: the routes have been renewed, and lines may have other numbers. A server to which
  /// no route leads any more answers what it has. On the server's thread.
  void Relink(std::span<bus::RouteTarget* const> lines);

  /// The target of this route; null: it leads nowhere now.
  bus::RouteTarget* of(std::size_t route) const { return targets_[route]; }
  /// As RouteTarget::Submit.
  bool Submit(bus::RouteTarget& target, bus::RoutedRequest request);
  /// Targets that hold requests of this client are told that it has left.
  void Abandon(std::uint64_t client);
  /// "drive" or "10.0.0.9:502", of the first route that leads there.
  std::string NameOf(const bus::RouteTarget* target) const;
  /// Every line that a route leads to, once.
  std::span<const Line> lines() const { return lines_; }

 private:
  using HostPort = std::pair<std::string, std::uint16_t>;

  void LinkLines(std::span<bus::RouteTarget* const> lines);
  void LinkServers();
  std::unique_ptr<Upstream> MakeServer(const HostPort& at);
  void CameLate(const HostPort& server, std::uint8_t slave);

  const RouteList& routes_;
  asio::io_context* io_ = nullptr;  ///< null: not open
  std::shared_ptr<TrafficBook> book_;
  /// None is removed: a client that has asked there may still have to be forgotten.
  std::map<HostPort, std::unique_ptr<Upstream>> servers_;
  std::vector<bus::RouteTarget*> targets_;  ///< by route
  std::vector<Line> lines_;
  /// By client: the targets that may still hold requests of it.
  std::map<std::uint64_t, std::vector<bus::RouteTarget*>> asked_;
};

/// One request for a route, and its client.
struct RoutedAsk {
  std::size_t route = 0;  ///< its number, or TrafficBook::kBroadcasts
  std::uint8_t unit = 0;  ///< as the client addresses it
  std::string_view peer{};
  bus::RouteTarget* target = nullptr;
  bool has_room = true;  ///< false: the client has too many requests under way
};

// The result of a request that was passed on: for the part that raises alarms of slaves that do not
// answer their clients (gateway/records/event_path.h).
struct RoutedReport {
  const config::Route& route;
  std::uint8_t unit = 0;  ///< as the client asked for it
  RouteOutcome end = RouteOutcome::no_reply;
  const bus::RoutedReply& reply;
};

/// On the server's thread; returns at once.
using OnRoutedReport = std::function<void(const RoutedReport& end, Now now)>;

class Router {
 public:
  /// Lines and log must outlive this object. See ModbusLinks.
  Router(const config::Config& config, std::span<bus::RouteTarget* const> lines,
         audit::WriteLog* log, OnRoutedReport routed, std::shared_ptr<TrafficBook> book);

  /// Makes the servers elsewhere.
  void Open(asio::io_context& io) { targets_.Open(io, book_); }
  void Close() { targets_.Close(); }
  /// A reload. `routes`: which are the same.
  void Apply(const config::Config& config, std::span<bus::RouteTarget* const> lines,
             const Origins& routes);

  const Way& WayOf(std::uint8_t unit) const { return table_.of(unit); }
  /// By its number.
  const config::Route& route(std::size_t number) const { return routes_.at(number); }
  /// Null: the route leads nowhere now.
  bus::RouteTarget* TargetOf(std::size_t route) const { return targets_.of(route); }
  /// Every line that a route leads to, once.
  std::span<const RouteTargets::Line> lines() const { return targets_.lines(); }

  /// False: it is busy, and the request has ended.
  bool Submit(const RoutedAsk& ask, bus::RoutedRequest request, const Now& now);
  /// The listener does not permit it.
  void Deny(const RoutedAsk& ask, View pdu, const std::string& reason, const Now& now);
  /// The answer of a target, other than to a broadcast.
  void OnEnd(std::size_t route, std::uint8_t unit, RouteOutcome end, const bus::RoutedReply& reply,
             const Now& now);
  /// A request whose client does not wait for it any more.
  void OnAbandoned(std::size_t route, std::uint8_t unit) {
    book_->Ended(route, unit, RouteOutcome::abandoned, {}, {});
  }
  /// Targets send nothing more of this client.
  void Abandon(std::uint64_t client) { targets_.Abandon(client); }

  /// Shared by what may outlive the server.
  const std::shared_ptr<TrafficBook>& book() const { return book_; }

 private:
  /// The record of a request that may write, where those are kept; else null.
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
