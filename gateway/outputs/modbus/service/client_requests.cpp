// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/client_requests.h"

#include "gateway/base/deadline.h"
#include "gateway/outputs/modbus/service/permission.h"

namespace baudgate::modbus {
namespace {

constexpr const char* kNotPermitted = "the listener does not permit it";

}  // namespace

ClientRequests::ClientRequests(const config::Listener& listener, ServerShared& shared,
                               ClientWire& wire, const std::string& peer, config::Priority priority,
                               const Now& now)
    : listener_(listener),
      router_(shared.router()),
      replies_(std::make_shared<ClientReplies>(listener, wire, shared.counters(), shared.book(),
                                               peer, priority, now.wall)),
      local_(std::make_shared<LocalRequests>(listener, shared.units(), shared.inbox(), replies_,
                                             shared.limits().write_deadline)),
      routed_(std::make_shared<RoutedRequests>(listener, router_, shared.inbox(), replies_,
                                               priority)) {}

void ClientRequests::Handle(View frame, const Now& now) {
  replies_->OnRequest(frame, now.instant);
  const Way way = router_.WayOf(UnitOf(frame));
  if (way.kind == Way::Kind::none) return replies_->Refuse(frame, kNoPath, now.instant);
  if (!Permits(listener_.permit, FunctionOf(frame))) return Deny(frame, way, now);
  if (way.kind == Way::Kind::route) return HandleRouted(frame, way.route, now);
  if (UnitOf(frame) == 0 && IsPlainWrite(FunctionOf(frame))) {
    return HandleBroadcast(frame, TrafficBook::kBroadcasts, router_.lines(), now);
  }
  local_->Handle(frame, HasRoom(), now);
}

void ClientRequests::Deny(View frame, const Way& way, const Now& now) {
  const bool gateway = way.kind == Way::Kind::gateway && UnitOf(frame) != 0;
  if (way.kind == Way::Kind::route) routed_->Deny(frame, way.route, kNotPermitted, now);
  if (way.kind == Way::Kind::device || gateway) local_->Deny(frame, kNotPermitted, now);
  replies_->Refuse(frame, kIllegalFunction, now.instant);
}

void ClientRequests::HandleRouted(View frame, std::size_t index, const Now& now) {
  const config::Route& route = router_.route(index);
  if (!IsFunction(FunctionOf(frame))) {
    return replies_->Refuse(frame, kIllegalFunction, now.instant);
  }
  const std::uint8_t slave = route.SlaveOf(UnitOf(frame));
  if (slave == 0 && !route.remap && IsPlainWrite(FunctionOf(frame))) {
    const RouteTargets::Line line{router_.TargetOf(index), route.deadline};
    return HandleBroadcast(frame, index, std::span(&line, 1), now);
  }
  // No slave of a line answers to 0; at a server it is a unit like others.
  if (slave == 0 && !route.line.empty()) return local_->Handle(frame, HasRoom(), now);
  routed_->Forward(frame, index, slave, HasRoom(), now);
}

void ClientRequests::HandleBroadcast(View frame, std::size_t index,
                                     std::span<const RouteTargets::Line> lines, const Now& now) {
  if (listener_.broadcast == config::Listener::Broadcast::ignore) {
    const ExceptionCode malformed = local_->Check(frame);
    const auto exception = malformed != kNoException ? malformed : kIllegalAddress;
    return replies_->Refuse(frame, exception, now.instant);
  }
  for (const RouteTargets::Line& line : lines) {
    if (line.target != nullptr) routed_->Broadcast(frame, index, line, HasRoom(), now);
  }
  replies_->AnswerNothing(now.instant);
}

void ClientRequests::Sweep(const Now& now) {
  local_->Sweep(now);
  routed_->Sweep(now);
}

std::optional<Instant> ClientRequests::Deadline() const {
  return Soonest({local_->Deadline(), routed_->Deadline()});
}

void ClientRequests::Abandon() {
  routed_->Abandon();
  local_->Abandon();
}

void ClientRequests::Close() {
  if (closed_) return;
  closed_ = true;
  Abandon();
  local_->Close();
  replies_->Close();
}

}  // namespace baudgate::modbus
