// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/route_targets.h"

#include <algorithm>
#include <set>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/outputs/modbus/upstream/upstream.h"

namespace baudgate::modbus {

RouteTargets::RouteTargets(const RouteList& routes, std::span<RouteTarget* const> lines)
    : routes_(routes) {
  LinkLines(lines);
}

RouteTargets::~RouteTargets() = default;

void RouteTargets::Open(asio::io_context& io, const std::shared_ptr<TrafficBook>& book) {
  io_ = &io;
  book_ = book;
  LinkServers();
}

void RouteTargets::Relink(std::span<RouteTarget* const> lines) {
  LinkLines(lines);
  LinkServers();
}

void RouteTargets::LinkLines(std::span<RouteTarget* const> lines) {
  lines_.clear();
  targets_.assign(routes_.size(), nullptr);
  for (const std::size_t number : routes_.numbers()) {
    const config::Route& route = routes_.at(number);
    if (route.line.empty() || route.line_index >= lines.size()) continue;
    RouteTarget* const target = lines[route.line_index];
    targets_[number] = target;
    const bool known =
        std::ranges::any_of(lines_, [&](const Line& line) { return line.target == target; });
    if (target != nullptr && !known) lines_.push_back({target, route.deadline});
  }
}

void RouteTargets::LinkServers() {
  if (io_ == nullptr) return;
  std::set<const Upstream*> used;
  for (const std::size_t number : routes_.numbers()) {
    const config::Route& route = routes_.at(number);
    if (!route.line.empty()) continue;
    const HostPort at(route.host, route.port);
    std::unique_ptr<Upstream>& server = servers_[at];
    if (!server) server = MakeServer(at);
    server->Start();
    used.insert(server.get());
    targets_[number] = server.get();
  }
  for (const auto& [at, server] : servers_) {
    if (!used.contains(server.get())) server->Rest();
  }
}

std::unique_ptr<Upstream> RouteTargets::MakeServer(const HostPort& at) {
  return std::make_unique<Upstream>(*io_, at.first, at.second,
                                    [this, at](std::uint8_t slave) { CameLate(at, slave); });
}

bool RouteTargets::Submit(RouteTarget& target, RoutedRequest request) {
  const std::uint64_t client = request.client;
  if (!target.Submit(std::move(request))) return false;
  if (client == 0) return true;  // a broadcast
  std::vector<RouteTarget*>& asked = asked_[client];
  if (std::ranges::find(asked, &target) == asked.end()) asked.push_back(&target);
  return true;
}

void RouteTargets::Abandon(std::uint64_t client) {
  const auto asked = asked_.extract(client);
  if (!asked) return;
  for (RouteTarget* target : asked.mapped()) target->Abandon(client);
}

std::string RouteTargets::NameOf(const RouteTarget* target) const {
  for (const std::size_t number : routes_.numbers()) {
    const config::Route& route = routes_.at(number);
    if (targets_[number] != target) continue;
    return route.line.empty() ? HostAndPort(route.host, route.port) : route.line;
  }
  return {};
}

/// At all routes that lead to this slave of the server.
void RouteTargets::CameLate(const HostPort& server, std::uint8_t slave) {
  for (const std::size_t number : routes_.numbers()) {
    const config::Route& other = routes_.at(number);
    const bool same_server = other.line.empty() && HostPort(other.host, other.port) == server;
    if (same_server && slave >= other.SlaveOf(other.first) && slave <= other.SlaveOf(other.last)) {
      book_->CameLate(number);
    }
  }
}

void RouteTargets::Close() {
  for (const auto& [at, server] : servers_) server->Stop();
}

}  // namespace baudgate::modbus
