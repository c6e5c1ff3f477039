// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/router.h"

#include <utility>

#include "protocols/modbus/pdu/modbus_pdu.h"

namespace baudgate::modbus {
namespace {

RoutedReply Busy() {
  RoutedReply reply;
  reply.outcome = Outcome::busy;
  reply.reason = "too many requests wait already";
  return reply;
}

}  // namespace

Router::Router(const config::Config& config, const ModbusLinks& links,
               std::shared_ptr<TrafficBook> book)
    : routes_(config.modbus.routes),
      table_(config, routes_),
      targets_(routes_, links.lines),
      log_(links.writes),
      routed_(links.routed),
      book_(std::move(book)) {
  book_->Show(routes_);
}

void Router::Apply(const config::Config& config, std::span<RouteTarget* const> lines,
                   const Origins& routes) {
  routes_.Renew(config.modbus.routes, routes);
  table_ = RouteTable(config, routes_);
  book_->Show(routes_);
  targets_.Relink(lines);
}

bool Router::Submit(const RoutedAsk& ask, RoutedRequest request, const Now& now) {
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

void Router::OnEnd(std::size_t route, std::uint8_t unit, RouteOutcome end, const RoutedReply& reply,
                   const Now& now) {
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
