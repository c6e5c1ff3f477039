// What one client asks and how it is answered, whatever wire it comes by: permission, cached units,
// writes, transparent routes, exceptions, deadlines. Whole frames in their Modbus TCP form come
// from session.cpp (sockets) and serial_listener.cpp (a serial master); answers go back to them.
// All on the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "config/config.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/modbus/request.h"
#include "gateway/modbus/service.h"

namespace baudgate::modbus {

class RequestDesk : public std::enable_shared_from_this<RequestDesk> {
 public:
  /// The way back to the client. The desk may be closed from within a call.
  class Wire {
   public:
    /// A read out of the store: the responder's private copy holds its values, during the call
    /// only.
    virtual void Answer(const ModbusRequest& request, Responder& responder) = 0;
    /// A whole frame in its Modbus TCP form: an exception, a routed reply.
    virtual void Answer(View frame) = 0;
    /// Request `frame` stays without any answer (a broadcast, a silent listener): a wire that
    /// takes one request at a time goes on.
    virtual void AnswerNothing() = 0;

   protected:
    ~Wire() = default;
  };

  /// Listener, service and wire outlive the desk until Close.
  RequestDesk(const config::Listener& listener, Service& service, Wire& wire, std::string peer,
              config::Priority priority);

  /// One whole frame, MBAP header included: leads to exactly one call of the wire, now or later.
  void Handle(View frame, Instant now);
  /// Answers requests whose deadline has passed and that nobody has answered.
  void Sweep(Instant now);
  /// The client has left: what it still waits for is forgotten, and the wire is not called again.
  void Close();

  std::size_t outstanding() const { return pending_.size(); }
  std::uint64_t id() const { return id_; }

 private:
  struct Pending {
    std::uint64_t number = 0;
    Instant deadline;
    Bytes frame;
  };

  const config::Listener& listener_;
  Service& service_;
  Wire& wire_;
  std::string peer_;
  config::Priority priority_;
  std::uint64_t id_ = 0;
  std::vector<Pending> pending_;
  std::uint64_t next_number_ = 0;
  bool closed_ = false;
};

}  // namespace baudgate::modbus
