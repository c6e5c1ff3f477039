// Where transparent routes lead: the lines that the composition root has given, and the servers
// elsewhere that are made here. Asked by request_desk.cpp for every routed request.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/time.h"
#include "gateway/modbus/desk/links.h"
#include "gateway/requests/routed.h"

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

  /// Configuration and lines outlive this.
  RouteTargets(const config::Modbus& modbus, const ModbusLinks& links);
  ~RouteTargets();
  RouteTargets(const RouteTargets&) = delete;
  RouteTargets& operator=(const RouteTargets&) = delete;

  /// Makes the servers elsewhere, one per host and port. Both on the server's thread.
  void Open(asio::io_context& io, const std::shared_ptr<TrafficBook>& book);
  void Close();

  /// A reload: the same routes, lines of other numbers. On the server's thread.
  void Relink(const config::Modbus& modbus, std::span<RouteTarget* const> lines);

  /// Of the route with this index; null: it leads nowhere now.
  RouteTarget* of(std::size_t route) const { return targets_[route]; }
  /// "drive" or "10.0.0.9:502", of the first route that leads there.
  std::string NameOf(const RouteTarget* target) const;
  /// Every line that a route leads to, once.
  std::span<const Line> lines() const { return lines_; }

 private:
  void CameLate(TrafficBook& book, const config::Route& server, std::uint8_t slave);

  const config::Modbus& modbus_;
  std::vector<std::unique_ptr<Upstream>> servers_;
  std::vector<RouteTarget*> targets_;  ///< by route
  std::vector<Line> lines_;
};

}  // namespace baudgate::modbus
