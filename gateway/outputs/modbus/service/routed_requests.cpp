// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/routed_requests.h"

#include <algorithm>
#include <utility>

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

RouteOutcome BroadcastOutcomeOf(const RoutedReply& reply, bool late) {
  const bool sent = reply.sent || reply.outcome == Outcome::ok;
  return sent ? RouteOutcome::broadcast : RouteOutcomeOf(reply, late);
}

}  // namespace

RoutedRequests::RoutedRequests(const config::Listener& listener, Router& router,
                               std::shared_ptr<Inbox> inbox, std::shared_ptr<ClientReplies> replies,
                               config::Priority priority)
    : listener_(listener),
      router_(router),
      inbox_(std::move(inbox)),
      replies_(std::move(replies)),
      priority_(priority) {}

void RoutedRequests::Forward(View frame, std::size_t route, std::uint8_t slave, bool has_room,
                             const Now& now) {
  RouteTarget* const target = router_.TargetOf(route);
  if (target == nullptr) return replies_->Refuse(frame, kNoPath, now.instant);
  const std::uint64_t number = pending_.NextNumber();
  RoutedRequest request = RequestOf(frame, router_.route(route).deadline, now);
  request.client = replies_->client().number;
  request.slave = slave;
  request.done = [inbox = inbox_, requests = weak_from_this(), number](RoutedReply reply) {
    inbox->Post([requests, number, reply = std::move(reply)](const Now& now) mutable {
      if (const auto self = requests.lock()) self->Finish(number, std::move(reply), now);
    });
  };
  PendingRequest pending;
  pending.number = number;
  pending.deadline = request.deadline;
  pending.frame = CopyOf(frame.first(kMbapHeader + 1));
  pending.route = route;
  if (!router_.Submit(AskOf(frame, route, target, has_room), std::move(request), now)) {
    return replies_->Refuse(frame, kBusy, now.instant);
  }
  replies_->Await(pending.Limit());
  pending_.Add(std::move(pending));
}

void RoutedRequests::Finish(std::uint64_t number, RoutedReply reply, const Now& now) {
  const auto pending = pending_.Take(number);
  if (!pending) return;
  replies_->Settle();
  const View asked = pending->frame;
  const bool late = now.instant >= pending->deadline;
  if (late && IsReply(reply)) {
    reply.outcome = Outcome::no_reply;
    reply.pdu.clear();
    reply.reason = "its reply came after the deadline";
  }
  router_.OnEnd(pending->route, UnitOf(asked), RouteOutcomeOf(reply, late), reply, now);
  if (!IsReply(reply)) return replies_->Refuse(asked, kNoTarget, now.instant);
  if (reply.outcome == Outcome::refused) replies_->CountException();
  if (!replies_->IsAwaited(asked)) return replies_->AnswerNothing(now.instant);
  replies_->Answer(AduOf(TransactionOf(asked), UnitOf(asked), reply.pdu), now.instant);
}

/// Without a client, because a client that broadcasts waits for nothing and may leave at once.
void RoutedRequests::Broadcast(View frame, std::size_t route, const RouteTargets::Line& line,
                               bool has_room, const Now& now) {
  RoutedRequest request = RequestOf(frame, line.deadline, now);
  request.broadcast = true;
  request.done = [inbox = inbox_, book = router_.book(), requests = weak_from_this(), route,
                  unit = UnitOf(frame), deadline = request.deadline](RoutedReply reply) {
    inbox->Post([book, requests, route, unit, deadline, reply = std::move(reply)](const Now& now) {
      book->Ended(route, unit, BroadcastOutcomeOf(reply, now.instant >= deadline), reply, now.wall);
      if (const auto self = requests.lock()) --self->broadcasts_;
    });
  };
  if (router_.Submit(AskOf(frame, route, line.target, has_room), std::move(request), now)) {
    ++broadcasts_;
  }
}

void RoutedRequests::Deny(View frame, std::size_t route, const std::string& reason,
                          const Now& now) {
  router_.Deny(AskOf(frame, route, router_.TargetOf(route), true), PduOf(frame), reason, now);
}

void RoutedRequests::Sweep(const Now& now) {
  RoutedReply nothing;
  nothing.outcome = Outcome::no_reply;
  nothing.reason = "no result was known when its deadline passed";
  nothing.sent = true;  // for all that is known
  for (const std::uint64_t number : pending_.Overdue(now.instant)) Finish(number, nothing, now);
}

/// Targets may still hold what the sweep has answered in their place.
void RoutedRequests::Abandon() {
  router_.Abandon(replies_->client().number);
  const auto abandoned = pending_.TakeAll();
  for (const PendingRequest& pending : abandoned) {
    router_.OnAbandoned(pending.route, UnitOf(pending.frame));
  }
  replies_->Settle(abandoned.size());
}

RoutedAsk RoutedRequests::AskOf(View frame, std::size_t route, RouteTarget* target,
                                bool has_room) const {
  return {.route = route,
          .unit = UnitOf(frame),
          .peer = replies_->client().name,
          .target = target,
          .has_room = has_room};
}

RoutedRequest RoutedRequests::RequestOf(View frame, Duration deadline, const Now& now) const {
  RoutedRequest request;
  request.pdu = CopyOf(PduOf(frame));
  request.priority = PriorityOf(FunctionOf(frame));
  request.arrived = now.instant;
  request.deadline = now.instant + deadline;
  return request;
}

config::Priority RoutedRequests::PriorityOf(std::uint8_t function) const {
  for (const config::FunctionPriority& rule : listener_.functions) {
    if (std::ranges::find(rule.codes, function) != rule.codes.end()) return rule.priority;
  }
  return priority_;
}

}  // namespace baudgate::modbus
