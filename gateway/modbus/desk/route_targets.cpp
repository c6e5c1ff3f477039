// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/desk/route_targets.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/modbus/desk/traffic_book.h"
#include "gateway/modbus/upstream/upstream.h"

namespace baudgate::modbus {

RouteTargets::RouteTargets(const config::Modbus& modbus, const ModbusLinks& links)
    : modbus_(modbus), targets_(modbus.routes.size()) {
  Relink(modbus, links.lines);
}

void RouteTargets::Relink(const config::Modbus& modbus, std::span<RouteTarget* const> lines) {
  lines_.clear();
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    const config::Route& route = modbus.routes[i];
    if (route.line.empty() || route.line_index >= lines.size()) continue;
    RouteTarget* const target = lines[route.line_index];
    targets_[i] = target;
    const bool known =
        std::ranges::any_of(lines_, [&](const Line& line) { return line.target == target; });
    if (target != nullptr && !known) lines_.push_back({target, route.deadline});
  }
}

RouteTargets::~RouteTargets() = default;

void RouteTargets::Open(asio::io_context& io, const std::shared_ptr<TrafficBook>& book) {
  std::map<std::pair<std::string, std::uint16_t>, Upstream*> made;
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    const config::Route& route = modbus_.routes[i];
    if (!route.line.empty()) continue;
    Upstream*& server = made[{route.host, route.port}];
    if (server == nullptr) {
      auto on_late = [this, book, &route](std::uint8_t slave) { CameLate(*book, route, slave); };
      servers_.push_back(
          std::make_unique<Upstream>(io, route.host, route.port, std::move(on_late)));
      server = servers_.back().get();
      server->Start();
    }
    targets_[i] = server;
  }
}

std::string RouteTargets::NameOf(const RouteTarget* target) const {
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    const config::Route& route = modbus_.routes[i];
    if (targets_[i] != target) continue;
    return route.line.empty() ? HostAndPort(route.host, route.port) : route.line;
  }
  return {};
}

/// At all routes that lead to this slave of the server.
void RouteTargets::CameLate(TrafficBook& book, const config::Route& server, std::uint8_t slave) {
  for (std::size_t i = 0; i < modbus_.routes.size(); ++i) {
    const config::Route& other = modbus_.routes[i];
    const bool same_server = other.line.empty() && other.Target() == server.Target();
    if (same_server && slave >= other.SlaveOf(other.first) && slave <= other.SlaveOf(other.last)) {
      book.CameLate(i);
    }
  }
}

void RouteTargets::Close() {
  for (const auto& server : servers_) server->Stop();
}

}  // namespace baudgate::modbus
