// Requests that go to a slave as they are, and broadcasts.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "gateway/modbus/service/request_service.h"

namespace baudgate::modbus {
namespace {

bool IsReply(const RoutedReply& reply) {
  const bool answered = reply.outcome == Outcome::ok || reply.outcome == Outcome::refused;
  return answered && !reply.pdu.empty() && reply.pdu.size() <= kMaxPdu;
}

RouteOutcome RouteOutcomeOf(const RoutedReply& reply, bool late) {
  if (IsReply(reply))
    return reply.outcome == Outcome::ok ? RouteOutcome::ok : RouteOutcome::refused;
  return late && !reply.sent ? RouteOutcome::expired : RouteOutcome::no_reply;
}

RoutedReply Busy() {
  RoutedReply reply;
  reply.outcome = Outcome::busy;
  reply.reason = "too many requests wait already";
  return reply;
}

}  // namespace

void RequestService::HandleRouted(View frame, std::size_t index, const Now& now) {
  const config::Route& route = shared_.route(index);
  if (!IsFunction(FunctionOf(frame))) return Refuse(frame, kIllegalFunction, now.instant);
  const std::uint8_t slave = route.SlaveOf(UnitOf(frame));
  if (slave == 0 && !route.remap && IsPlainWrite(FunctionOf(frame))) {
    const RouteTargets::Line line{shared_.targets().of(index), route.deadline};
    return HandleBroadcast(frame, index, std::span(&line, 1), now);
  }
  // No slave of a line answers to 0; at a server it is a unit like others.
  if (slave == 0 && !route.line.empty()) return HandleOwn(frame, now);
  Forward(frame, index, slave, now);
}

void RequestService::Forward(View frame, std::size_t index, std::uint8_t slave, const Now& now) {
  const config::Route& route = shared_.route(index);
  RouteTarget* const target = shared_.targets().of(index);
  if (target == nullptr) return Refuse(frame, kNoPath, now.instant);
  const std::uint64_t number = next_number_++;
  RoutedRequest request;
  request.client = record_->id;
  request.slave = slave;
  request.pdu = CopyOf(PduOf(frame));
  request.priority = PriorityOf(FunctionOf(frame));
  request.arrived = now.instant;
  request.deadline = now.instant + route.deadline;
  request.done = [inbox = shared_.inbox(), service = weak_from_this(), number](RoutedReply reply) {
    inbox->Post([service, number, reply = std::move(reply)](const Now& now) mutable {
      if (const auto self = service.lock()) self->FinishRouted(number, std::move(reply), now);
    });
  };
  const auto witness = WitnessOf(frame, target, now);
  if (witness) request.done = audit::Witness::Watch(witness, std::move(request.done));
  shared_.book()->Asked(index, UnitOf(frame));
  const bool room = pending_.size() + broadcasts_ < kMaxPending;
  if (!room || !target->Submit(std::move(request))) {
    if (witness) witness->Deny(WriteEnd::busy, Busy().reason);
    shared_.book()->Ended(index, UnitOf(frame), RouteOutcome::busy, Busy(), now.wall);
    return Refuse(frame, kBusy, now.instant);
  }
  if (std::ranges::find(used_, target) == used_.end()) used_.push_back(target);
  AddPending({number, now.instant + route.deadline, index, CopyOf(frame.first(kMbapHeader + 1))});
}

void RequestService::FinishRouted(std::uint64_t number, RoutedReply reply, const Now& now) {
  const auto pending = TakePending(number);
  if (!pending) return;
  const View asked = pending->frame;
  const bool late = now.instant >= pending->deadline;
  if (late && IsReply(reply)) {
    reply.outcome = Outcome::no_reply;
    reply.pdu.clear();
    reply.reason = "its reply came after the deadline";
  }
  const RouteOutcome end = RouteOutcomeOf(reply, late);
  shared_.book()->Ended(*pending->route, UnitOf(asked), end, reply, now.wall);
  shared_.OnRouted({shared_.route(*pending->route), UnitOf(asked), end, reply}, now);
  if (!IsReply(reply)) return Refuse(asked, kNoTarget, now.instant);
  if (reply.outcome == Outcome::refused) {
    LiveCounters::Add(shared_.counters().exceptions);
    ClientRecord::Add(record_->exceptions);
  }
  if (IsUnawaited(asked)) return wire_.AnswerNothing(now.instant);
  Answer(AduOf(TransactionOf(asked), UnitOf(asked), reply.pdu), now.instant);
}

void RequestService::HandleBroadcast(View frame, std::size_t index,
                                     std::span<const RouteTargets::Line> lines, const Now& now) {
  if (listener_.broadcast == config::Listener::Broadcast::ignore) {
    ModbusRequest request;
    const ExceptionCode malformed = shared_.units().Check(frame, request);
    return Refuse(frame, malformed != kNoException ? malformed : kIllegalAddress, now.instant);
  }
  for (const RouteTargets::Line& line : lines) {
    if (line.target == nullptr) continue;
    shared_.book()->Asked(index, UnitOf(frame));
    if (Broadcast(frame, index, line, now)) continue;
    shared_.book()->Ended(index, UnitOf(frame), RouteOutcome::busy, Busy(), now.wall);
  }
  wire_.AnswerNothing(now.instant);
}

/// Without a client, because a client that broadcasts waits for nothing and may leave at once.
bool RequestService::Broadcast(View frame, std::size_t index, const RouteTargets::Line& line,
                               const Now& now) {
  const auto witness = WitnessOf(frame, line.target, now, true);
  const bool room = pending_.size() + broadcasts_ < kMaxPending;
  RoutedRequest request;
  request.client = 0;
  request.slave = 0;
  request.broadcast = true;
  request.pdu = CopyOf(PduOf(frame));
  request.priority = PriorityOf(FunctionOf(frame));
  request.arrived = now.instant;
  request.deadline = now.instant + line.deadline;
  request.done = [inbox = shared_.inbox(), book = shared_.book(), service = weak_from_this(), index,
                  unit = UnitOf(frame), deadline = request.deadline](RoutedReply reply) {
    inbox->Post([book, service, index, unit, deadline, reply = std::move(reply)](const Now& now) {
      const bool sent = reply.sent || reply.outcome == Outcome::ok;
      const auto unsent = RouteOutcomeOf(reply, now.instant >= deadline);
      book->Ended(index, unit, sent ? RouteOutcome::broadcast : unsent, reply, now.wall);
      if (const auto self = service.lock()) --self->broadcasts_;
    });
  };
  if (witness) request.done = audit::Witness::Watch(witness, std::move(request.done));
  if (!room || !line.target->Submit(std::move(request))) {
    if (witness) witness->Deny(WriteEnd::busy, Busy().reason);
    return false;
  }
  ++broadcasts_;
  return true;
}

std::shared_ptr<audit::Witness> RequestService::WitnessOf(View frame, const RouteTarget* target,
                                                          const Now& now, bool broadcast) const {
  if (shared_.audit() == nullptr || !MayChangeSlave(PduOf(frame))) return nullptr;
  const audit::RoutedWrite write{
      record_->peer, shared_.targets().NameOf(target), UnitOf(frame), broadcast, PduOf(frame), now};
  return std::make_shared<audit::Witness>(*shared_.audit(), write);
}

config::Priority RequestService::PriorityOf(std::uint8_t function) const {
  for (const config::FunctionPriority& rule : listener_.functions) {
    if (std::ranges::find(rule.codes, function) != rule.codes.end()) return rule.priority;
  }
  return priority_;
}

}  // namespace baudgate::modbus
