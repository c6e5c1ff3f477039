// Where transparent routes lead: the lines that the composition root has given, and the servers
// elsewhere that are made here. Asked by router.cpp for every routed request.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/bus/writes/routed.h"
#include "gateway/outputs/modbus/service/route_list.h"

namespace baudgate::modbus {

class TrafficBook;
class Upstream;

class RouteTargets {
 public:
  /// A line that broadcasts go to, with the deadline of the first route that leads to it.
  struct Line {
    RouteTarget* target = nullptr;
    Duration deadline{};
  };

  /// All outlive this. `lines`: by the numbers of the store.
  RouteTargets(const RouteList& routes, std::span<RouteTarget* const> lines);
  ~RouteTargets();
  RouteTargets(const RouteTargets&) = delete;
  RouteTargets& operator=(const RouteTargets&) = delete;

  /// Makes the servers elsewhere, one per host and port. Both on the server's thread.
  void Open(asio::io_context& io, const std::shared_ptr<TrafficBook>& book);
  void Close();

  /// A reload: the routes have been renewed, and lines may have other numbers. A server to which
  /// no route leads any more answers what it has. On the server's thread.
  void Relink(std::span<RouteTarget* const> lines);

  /// The target of this route; null: it leads nowhere now.
  RouteTarget* of(std::size_t route) const { return targets_[route]; }
  /// As RouteTarget::Submit.
  bool Submit(RouteTarget& target, RoutedRequest request);
  /// Targets that hold requests of this client are told that it has left.
  void Abandon(std::uint64_t client);
  /// "drive" or "10.0.0.9:502", of the first route that leads there.
  std::string NameOf(const RouteTarget* target) const;
  /// Every line that a route leads to, once.
  std::span<const Line> lines() const { return lines_; }

 private:
  using HostPort = std::pair<std::string, std::uint16_t>;

  void LinkLines(std::span<RouteTarget* const> lines);
  void LinkServers();
  std::unique_ptr<Upstream> MakeServer(const HostPort& at);
  void CameLate(const HostPort& server, std::uint8_t slave);

  const RouteList& routes_;
  asio::io_context* io_ = nullptr;  ///< null: not open
  std::shared_ptr<TrafficBook> book_;
  /// None is removed: a client that has asked there may still have to be forgotten.
  std::map<HostPort, std::unique_ptr<Upstream>> servers_;
  std::vector<RouteTarget*> targets_;  ///< by route
  std::vector<Line> lines_;
  /// By client: the targets that may still hold requests of it.
  std::map<std::uint64_t, std::vector<RouteTarget*>> asked_;
};

}  // namespace baudgate::modbus
