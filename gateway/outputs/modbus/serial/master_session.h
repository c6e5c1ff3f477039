// What a serial master asks and is answered while a port is open. Bytes come from
// serial_listener.cpp, which has the port and the clock; requests go to
// gateway/outputs/modbus/service/client_requests.h in their Modbus TCP form, and its answers go
// back as frames of the serial line. Other slaves may answer on the same bus.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "config/model/listener.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/outputs/modbus/serial/reply_echo.h"
#include "gateway/outputs/modbus/service/client_requests.h"
#include "gateway/outputs/modbus/service/server_shared.h"
#include "protocols/assembler.h"
#include "protocols/protocol.h"

namespace baudgate::modbus {

/// The master has one request at a time: when it sends another before it was answered, it has given
/// up, and the old answer is dropped.
class MasterSession final : public ClientWire {
 public:
  class Owner {
   public:
    virtual void Send(Bytes frame) = 0;
    /// Deadline may have changed.
    virtual void Rearm() = 0;

   protected:
    ~Owner() = default;
  };

  /// `port`: its place in the traffic book. All others outlive the session; the protocol of the
  /// listener's framing is loaded and has a carrier.
  MasterSession(const config::Listener& listener, ServerShared& shared, std::size_t port,
                Owner& owner, const Now& now);
  ~MasterSession() { requests_.Close(); }
  MasterSession(const MasterSession&) = delete;
  MasterSession& operator=(const MasterSession&) = delete;

  /// `now.instant`: when they came.
  void OnBytes(View bytes, const Now& now);
  /// To be called at Deadline, and at any other time.
  void OnTime(const Now& now);
  /// The end of a gap, of the quiet before a reply, or of a request's deadline; empty: none.
  std::optional<Instant> Deadline() const;

 private:
  void Answer(const ModbusRequest& request, Responder& responder, Instant now) override;
  void Answer(View frame, Instant now) override;
  void AnswerNothing(Instant) override { awaited_.reset(); }
  void SweepAt(Instant) override { owner_.Rearm(); }

  const Protocol& protocol() const { return *frames_.Of(listener_.framing); }
  void CutFrames(bool silent, const Now& now);
  void OnFrame(const Bytes& frame, const Now& now);
  void NameOther();
  bool HoldsBytes() const { return assembler_.held() > 0 || echo_.holding(); }
  void SendReply(Instant now);

  const config::Listener& listener_;
  const Frames frames_;
  TrafficBook& book_;
  const std::size_t port_;
  Owner& owner_;
  const Duration quiet_;  ///< 3.5 characters: between a request and its reply
  const Duration gap_;    ///< a frame that rests so long is not going on

  ClientRequests requests_;
  Assembler assembler_;
  ReplyEcho echo_;
  Bytes heard_;  ///< since the last silence or request, as much as is looked at
  Instant last_byte_;
  std::uint16_t transaction_ = 0;         // of the last request
  std::optional<std::uint16_t> awaited_;  // the one that the master waits for
  Bytes reply_;                           // waits for the quiet before it
};

}  // namespace baudgate::modbus
