// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/router.h"

#include <algorithm>
#include <set>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/outputs/modbus/upstream/upstream.h"
#include "protocols/modbus_pdu/modbus_pdu.h"

namespace baudgate::modbus {

RouteTargets::RouteTargets(const RouteList& routes, std::span<bus::RouteTarget* const> lines)
    : routes_(routes) {
  LinkLines(lines);
}

RouteTargets::~RouteTargets() = default;

void RouteTargets::Open(asio::io_context& io, const std::shared_ptr<TrafficBook>& book) {
  io_ = &io;
  book_ = book;
  LinkServers();
}

void RouteTargets::Relink(std::span<bus::RouteTarget* const> lines) {
  LinkLines(lines);
  LinkServers();
}

void RouteTargets::LinkLines(std::span<bus::RouteTarget* const> lines) {
  lines_.clear();
  targets_.assign(routes_.size(), nullptr);
  for (const std::size_t number : routes_.numbers()) {
    const config::Route& route = routes_.at(number);
    if (route.line.empty() || route.line_index >= lines.size()) continue;
    bus::RouteTarget* const target = lines[route.line_index];
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
    const ServerKey at(route.host, route.port, route.tls);
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

std::unique_ptr<Upstream> RouteTargets::MakeServer(const ServerKey& at) {
  const auto& [host, port, tls] = at;
  return std::make_unique<Upstream>(*io_, host, port, tls,
                                    [this, at](std::uint8_t slave) { CameLate(at, slave); });
}

bool RouteTargets::Submit(bus::RouteTarget& target, bus::RoutedRequest request) {
  const std::uint64_t client = request.client;
  if (!target.Submit(std::move(request))) return false;
  if (client == 0) return true;
  std::vector<bus::RouteTarget*>& asked = asked_[client];
  if (std::ranges::find(asked, &target) == asked.end()) asked.push_back(&target);
  return true;
}

void RouteTargets::Abandon(std::uint64_t client) {
  const auto asked = asked_.extract(client);
  if (!asked) return;
  for (bus::RouteTarget* target : asked.mapped()) target->Abandon(client);
}

std::string RouteTargets::NameOf(const bus::RouteTarget* target) const {
  for (const std::size_t number : routes_.numbers()) {
    const config::Route& route = routes_.at(number);
    if (targets_[number] != target) continue;
    return route.line.empty() ? HostAndPort(route.host, route.port) : route.line;
  }
  return {};
}

void RouteTargets::CameLate(const ServerKey& server, std::uint8_t slave) {
  for (const std::size_t number : routes_.numbers()) {
    const config::Route& other = routes_.at(number);
    const bool same_server =
        other.line.empty() && ServerKey(other.host, other.port, other.tls) == server;
    if (same_server && slave >= other.SlaveOf(other.first) && slave <= other.SlaveOf(other.last)) {
      book_->CameLate(number);
    }
  }
}

void RouteTargets::Close() {
  for (const auto& [at, server] : servers_) server->Stop();
}

namespace {

bus::RoutedReply Busy() {
  bus::RoutedReply reply;
  reply.outcome = Outcome::busy;
  reply.reason = "the request was not sent, because too many requests wait already";
  return reply;
}

}  // namespace

Router::Router(const config::Config& config, std::span<bus::RouteTarget* const> lines,
               audit::WriteLog* log, OnRoutedReport routed, std::shared_ptr<TrafficBook> book)
    : routes_(config.modbus.routes),
      table_(config, routes_),
      targets_(routes_, lines),
      log_(log),
      routed_(std::move(routed)),
      book_(std::move(book)) {
  book_->Show(routes_);
}

void Router::Apply(const config::Config& config, std::span<bus::RouteTarget* const> lines,
                   const Origins& routes) {
  routes_.Renew(config.modbus.routes, routes);
  table_ = RouteTable(config, routes_);
  book_->Show(routes_);
  targets_.Relink(lines);
}

bool Router::Submit(const RoutedAsk& ask, bus::RoutedRequest request, const Now& now) {
  const auto witness = WitnessOf(ask, request.pdu, request.broadcast, now);
  if (witness) request.done = audit::Witness::Watch(witness, std::move(request.done));
  book_->Asked(ask.route, ask.unit);
  if (!ask.has_room || !targets_.Submit(*ask.target, std::move(request))) {
    if (witness) witness->Deny(WriteEnd::busy, Busy().reason);
    book_->Ended(ask.route, ask.unit, RouteOutcome::busy, Busy(), now.wall);
    return false;
  }
  return true;
}

void Router::Deny(const RoutedAsk& ask, View pdu, const std::string& reason, const Now& now) {
  if (const auto witness = WitnessOf(ask, pdu, false, now)) witness->Deny(WriteEnd::denied, reason);
  book_->Asked(ask.route, ask.unit);
  book_->Ended(ask.route, ask.unit, RouteOutcome::denied, {}, now.wall);
}

void Router::OnEnd(std::size_t route, std::uint8_t unit, RouteOutcome end,
                   const bus::RoutedReply& reply, const Now& now) {
  book_->Ended(route, unit, end, reply, now.wall);
  if (routed_) routed_({routes_.at(route), unit, end, reply}, now);
}

std::shared_ptr<audit::Witness> Router::WitnessOf(const RoutedAsk& ask, View pdu, bool broadcast,
                                                  const Now& now) const {
  if (log_ == nullptr || !MayChangeSlave(pdu)) return nullptr;
  const audit::RoutedWrite write{
      std::string(ask.peer), targets_.NameOf(ask.target), ask.unit, broadcast, pdu, now};
  return std::make_shared<audit::Witness>(*log_, write);
}

}  // namespace baudgate::modbus
