// The way back to one client: what a session implements, so that requests of its client can be
// answered now or later. On the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/registers/responder.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

class ClientWire {
 public:
  /// A read out of the store: the responder's private copy holds what was asked for, during the
  /// call only.
  virtual void Answer(const ModbusRequest& request, Responder& responder, Instant now) = 0;
  /// A whole frame in its Modbus TCP form: a confirmed write, an exception, a routed reply.
  virtual void Answer(View frame, Instant now) = 0;
  /// A request gets no answer (a broadcast, a silent listener): a wire that takes one request at
  /// a time goes on.
  virtual void AnswerNothing(Instant now) = 0;
  /// Call Sweep at this time, or earlier. Calls add up; none replaces an earlier one.
  virtual void SweepAt(Instant at) = 0;

 protected:
  ~ClientWire() = default;
};

}  // namespace baudgate::modbus
