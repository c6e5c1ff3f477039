// Handles the requests of one client of any wire: decides whether each is permitted and who answers
// it.
// Whole frames in their Modbus TCP form come from gateway/outputs/modbus/server/client_session.cpp
// (sockets) and gateway/outputs/modbus/serial/master_session.cpp (a serial master); answers go back
// to them. All on the server's thread; the time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "config/model/listener.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/service/local_requests.h"
#include "gateway/outputs/modbus/service/routed_requests.h"
#include "gateway/outputs/modbus/service/server_shared.h"

namespace baudgate::modbus {

class ClientRequests {
 public:
  /// Listener, `shared` and wire outlive it until Close.
  ClientRequests(const config::Listener& listener, ServerShared& shared, ClientWire& wire,
                 const std::string& peer, config::Priority priority, const Now& now);

  /// One whole frame, MBAP header included: leads to exactly one call of the wire, now or later,
  /// unless it is given up before.
  void Handle(View frame, const Now& now);
  /// Whether anything answers for this unit.
  bool Serves(std::uint8_t unit) const { return router_.WayOf(unit).kind != Way::Kind::none; }
  /// Answers requests whose deadline has passed without an answer. An answer may close the client,
  /// but must not destroy this object.
  void Sweep(const Now& now);
  /// The client waits for none of its requests any more. Requests that are not on the wire are not
  /// sent: routed ones by RouteTarget::Abandon, writes by WriteCommand::abandoned. None is
  /// answered.
  void Abandon();
  /// The client sends Modbus in another framing.
  void HeardOther(Framing heard, WallTime at) { replies_->HeardOther(heard, at); }
  /// The client has left: Abandon, and what is kept of it is forgotten (selections and its place
  /// among the events by LocalUnits::Forget, its entry in the traffic book). The wire is not
  /// called again.
  void Close();

  std::size_t outstanding() const { return local_->outstanding() + routed_->outstanding(); }
  /// When Sweep has something to answer; empty: nothing waits.
  std::optional<Instant> Deadline() const;

 private:
  void Deny(View frame, const Way& way, const Now& now);
  void HandleRouted(View frame, std::size_t index, const Now& now);
  void HandleBroadcast(View frame, std::size_t index, std::span<const RouteTargets::Line> lines,
                       const Now& now);
  bool HasRoom() const { return outstanding() + routed_->broadcasts() < PendingRequests::kMost; }

  const config::Listener& listener_;
  Router& router_;
  const std::shared_ptr<ClientReplies> replies_;
  const std::shared_ptr<LocalRequests> local_;
  const std::shared_ptr<RoutedRequests> routed_;
  bool closed_ = false;
};

}  // namespace baudgate::modbus
