// Requests of one client that are answered here: reads at once, writes when they have ended or
// their deadline has passed. On the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "config/model/listener.h"
#include "gateway/outputs/modbus/service/client_replies.h"
#include "gateway/outputs/modbus/service/inbox.h"
#include "gateway/outputs/modbus/service/local_units.h"
#include "gateway/outputs/modbus/service/pending_requests.h"

namespace baudgate::modbus {

class LocalRequests : public std::enable_shared_from_this<LocalRequests> {
 public:
  /// Listener and units outlive it until Close. `write_deadline`: see ModbusLimits.
  LocalRequests(const config::Listener& listener, LocalUnits& units, std::shared_ptr<Inbox> inbox,
                std::shared_ptr<ClientReplies> replies, Duration write_deadline);

  /// Without room, a write is answered "busy".
  void Handle(View frame, bool has_room, const Now& now);
  /// Unit, function, counts and lengths.
  ExceptionCode Check(View frame) const;
  /// It is not permitted: a write is recorded as denied. The caller answers.
  void Deny(View frame, const std::string& reason, const Now& now);

  void Sweep(const Now& now);
  std::optional<Instant> Deadline() const { return pending_.Deadline(); }
  /// Writes that are not on the wire are not sent. None is answered.
  void Abandon();
  /// The client has left.
  void Close();
  std::size_t outstanding() const { return pending_.size(); }

 private:
  ExceptionCode Start(const ModbusRequest& request, Instant now);
  void Finish(std::uint64_t number, const WriteResult& result, Instant now);

  const config::Listener& listener_;
  LocalUnits& units_;
  const std::shared_ptr<Inbox> inbox_;
  const std::shared_ptr<ClientReplies> replies_;
  const Duration write_deadline_;
  PendingRequests pending_;
  std::shared_ptr<std::atomic<bool>> abandoned_;  ///< of the writes since Abandon; null: none
};

}  // namespace baudgate::modbus
