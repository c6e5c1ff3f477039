// Requests of one client that go to slaves as they are, and broadcasts. On the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "config/model/listener.h"
#include "gateway/outputs/modbus/service/client_replies.h"
#include "gateway/outputs/modbus/service/inbox.h"
#include "gateway/outputs/modbus/service/pending_requests.h"
#include "gateway/outputs/modbus/service/router.h"

namespace baudgate::modbus {

class RoutedRequests : public std::enable_shared_from_this<RoutedRequests> {
 public:
  /// Listener and router outlive it until Abandon was called for the last time. `priority`: of
  /// functions for which the listener has none.
  RoutedRequests(const config::Listener& listener, Router& router, std::shared_ptr<Inbox> inbox,
                 std::shared_ptr<ClientReplies> replies, config::Priority priority);

  /// `route`: its number. Without room it is answered "busy".
  void Forward(View frame, std::size_t route, std::uint8_t slave, bool has_room, const Now& now);
  /// To all slaves of a line; the caller answers nothing.
  void Broadcast(View frame, std::size_t route, const RouteTargets::Line& line, bool has_room,
                 const Now& now);
  /// It is not permitted: that is counted and recorded. The caller answers.
  void Deny(View frame, std::size_t route, const std::string& reason, const Now& now);

  void Sweep(const Now& now);
  std::optional<Instant> Deadline() const { return pending_.Deadline(); }
  /// Requests that are not on the wire are not sent. None is answered.
  void Abandon();
  std::size_t outstanding() const { return pending_.size(); }
  /// Broadcasts under way.
  std::size_t broadcasts() const { return broadcasts_; }

 private:
  void Finish(std::uint64_t number, RoutedReply reply, const Now& now);
  RoutedAsk AskOf(View frame, std::size_t route, RouteTarget* target, bool has_room) const;
  RoutedRequest RequestOf(View frame, Duration deadline, const Now& now) const;
  config::Priority PriorityOf(std::uint8_t function) const;

  const config::Listener& listener_;
  Router& router_;
  const std::shared_ptr<Inbox> inbox_;
  const std::shared_ptr<ClientReplies> replies_;
  const config::Priority priority_;
  PendingRequests pending_;
  std::size_t broadcasts_ = 0;
};

}  // namespace baudgate::modbus
