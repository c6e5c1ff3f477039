// Sends the answers to one client and keeps its numbers in the traffic book: bytes, functions,
// exceptions, requests that wait. Decides which exceptions a silent listener does not send, and
// which requests get no answer. On the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "config/model/listener.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/modbus/service/client_wire.h"
#include "gateway/outputs/modbus/service/live_counters.h"
#include "gateway/outputs/modbus/service/traffic_book.h"

namespace baudgate::modbus {

class ClientReplies {
 public:
  /// Listener, wire and counters outlive it until Close.
  ClientReplies(const config::Listener& listener, ClientWire& wire, LiveCounters& counters,
                std::shared_ptr<TrafficBook> book, const std::string& peer,
                config::Priority priority, WallTime since);

  /// The client, as its requests carry it.
  const Writer& client() const { return client_; }

  void OnRequest(View frame, Instant now);
  void Answer(const ModbusRequest& request, Responder& responder, Instant now);
  void Answer(View frame, Instant now);
  void AnswerNothing(Instant now) { wire_.AnswerNothing(now); }
  void Refuse(View frame, ExceptionCode exception, Instant now);
  /// A slave has answered an exception.
  void CountException();
  bool IsAwaited(View request) const;

  /// One more request waits: the client is swept at this time.
  void Await(Instant limit);
  /// So many wait no more.
  void Settle(std::size_t count = 1);

  /// The client sends Modbus in another framing.
  void HeardOther(Framing heard, WallTime at);
  /// The client has left: it is in the book no more, and the wire is not called again.
  void Close() { book_->Leave(*record_); }

 private:
  std::size_t BytesOnWire(std::size_t frame) const;

  const config::Listener& listener_;
  ClientWire& wire_;
  LiveCounters& counters_;
  const std::shared_ptr<TrafficBook> book_;
  const std::shared_ptr<ClientRecord> record_;
  const Writer client_;
};

}  // namespace baudgate::modbus
