// The transparent routes of a Modbus server: which unit goes where, and what is kept of each
// request that is passed on: its count in the traffic book and, if it may write, its record. Shared
// by all clients. On the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "config/model/config.h"
#include "gateway/bus/writes/routed.h"
#include "gateway/outputs/modbus/service/links.h"
#include "gateway/outputs/modbus/service/route_list.h"
#include "gateway/outputs/modbus/service/route_table.h"
#include "gateway/outputs/modbus/service/route_targets.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/records/audit/routed_record.h"

namespace baudgate::modbus {

/// One request for a route, and its client.
struct RoutedAsk {
  std::size_t route = 0;  ///< its number, or TrafficBook::kBroadcasts
  std::uint8_t unit = 0;  ///< as the client addresses it
  std::string_view peer{};
  RouteTarget* target = nullptr;
  bool has_room = true;  ///< false: the client has too many requests under way
};

class Router {
 public:
  /// Lines and log outlive it.
  Router(const config::Config& config, const ModbusLinks& links, std::shared_ptr<TrafficBook> book);

  /// Makes the servers elsewhere.
  void Open(asio::io_context& io) { targets_.Open(io, book_); }
  void Close() { targets_.Close(); }
  /// A reload. `routes`: which are the same.
  void Apply(const config::Config& config, std::span<RouteTarget* const> lines,
             const Origins& routes);

  const Way& WayOf(std::uint8_t unit) const { return table_.of(unit); }
  /// By its number.
  const config::Route& route(std::size_t number) const { return routes_.at(number); }
  /// Null: the route leads nowhere now.
  RouteTarget* TargetOf(std::size_t route) const { return targets_.of(route); }
  /// Every line that a route leads to, once.
  std::span<const RouteTargets::Line> lines() const { return targets_.lines(); }

  /// False: it is busy, and the request has ended.
  bool Submit(const RoutedAsk& ask, RoutedRequest request, const Now& now);
  /// The listener does not permit it.
  void Deny(const RoutedAsk& ask, View pdu, const std::string& reason, const Now& now);
  /// The answer of a target, other than to a broadcast.
  void OnEnd(std::size_t route, std::uint8_t unit, RouteOutcome end, const RoutedReply& reply,
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
