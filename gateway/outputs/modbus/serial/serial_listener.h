// `SerialListener` is a serial port over which a Modbus master sends requests to the gateway: it
// opens the port, sets the timer and reads the clock. `MasterSession` handles the bytes.
// `ReplyEcho` recognises the echo of the gateway's own replies.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "config/model/outputs.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/outputs/modbus/service/client_requests.h"
#include "protocols/assembler.h"
#include "protocols/protocol.h"
#include "transports/port_keeper.h"

namespace baudgate::modbus {

// `ReplyEcho` recognises the gateway's own replies among the bytes that a two-wire adapter
// receives. The reply to a write of one register equals the request, so an echo that is taken for a
// request would be carried out and answered again endlessly. No I/O, no clock.

/// In mode `strip`, if the first bytes after a reply repeat the reply, they are removed, however
/// late they come. In mode `off`, no bytes are removed. In both modes IsEcho compares the first
/// whole frame after a reply with the reply, because noise before an echo prevents its removal.
class ReplyEcho {
 public:
  /// An echo must have ended within this time after the reply's last byte was sent. The time covers
  /// an adapter, its driver and a busy machine.
  static constexpr Duration kLatest = 50ms;

  explicit ReplyEcho(config::Listener::Echo mode)
      : strips_(mode == config::Listener::Echo::strip) {}

  /// Must be called before a reply is sent. `until`: the latest time at which the last byte of its
  /// echo can arrive.
  void OnSent(View reply, Instant until);
  Bytes Filter(View received);
  /// True while received bytes are withheld because they can be the beginning of an echo.
  bool holding() const { return strips_ && filter_.holding(); }
  /// Must be called when the bus is silent. Returns the withheld bytes.
  Bytes OnSilence() { return filter_.OnExchangeEnd().bytes; }
  /// True if `frame`, cut from the filtered bytes, is the echo of the last reply. `ended`: the time
  /// of the frame's last byte. Only the first frame after a reply is compared.
  bool IsEcho(View frame, Instant ended);

 private:
  bool strips_;
  bus::EchoFilter filter_{config::Echo::strip};
  Bytes owed_;  ///< the last reply, whose echo has not come; else empty
  Instant until_;
};

// `MasterSession` handles the requests of a serial master while the port is open. Bytes come from
// `SerialListener`. Requests are passed in their Modbus TCP form to
// gateway/outputs/modbus/service/client_requests.h, and replies return as frames of the serial
// line. Other slaves can be on the same bus.

/// A master has only one request at a time: if it sends another request before the reply, it has
/// given up the first request, and the reply to it is dropped.
class MasterSession final : public ClientWire {
 public:
  class Owner {
   public:
    virtual void Send(Bytes frame) = 0;
    /// Is called when the result of Deadline may have changed.
    virtual void Rearm() = 0;

   protected:
    ~Owner() = default;
  };

  /// `port`: the master's number in the traffic book. All references must outlive the session. The
  /// protocol of the listener's framing must be loaded and must support framing (have a carrier).
  MasterSession(const config::Listener& listener, ServerShared& shared, std::size_t port,
                Owner& owner, const Now& now);
  ~MasterSession() { requests_.Close(); }
  MasterSession(const MasterSession&) = delete;
  MasterSession& operator=(const MasterSession&) = delete;

  /// `now.instant` is the time when the bytes were received.
  void OnBytes(View bytes, const Now& now);
  /// Must be called at Deadline; earlier calls do no harm.
  void OnTime(const Now& now);
  /// Returns the next time at which OnTime has work: a pause ends a frame, the quiet time before a
  /// reply is over, or the deadline of a request passes. Nothing: there is no such time.
  std::optional<Instant> Deadline() const;

 private:
  void Answer(const ModbusRequest& request, Responder& responder, Instant now) override;
  void Answer(View frame, Instant now) override;
  void AnswerNothing(Instant) override { awaited_.reset(); }
  void SweepAt(Instant) override { owner_.Rearm(); }

  const protocols::Protocol& protocol() const { return *frames_.Of(listener_.framing); }
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
  const Duration quiet_;
  const Duration gap_;  ///< a pause of this length ends a frame, even an incomplete frame

  ClientRequests requests_;
  protocols::Assembler assembler_;
  ReplyEcho echo_;
  Bytes heard_;  ///< the first bytes since the last pause or frame, at most kMostLookedAt
  Instant last_byte_;
  std::uint16_t transaction_ = 0;
  // The transaction number of the request whose reply the master waits for.
  std::optional<std::uint16_t> awaited_;
  Bytes reply_;  // a reply that waits for the end of the quiet time
};

/// Must be created by make_shared. Only the server's thread may call it, except ClosePort.
class SerialListener final : public std::enable_shared_from_this<SerialListener>,
                             private transports::PortThread::Owner,
                             public MasterSession::Owner {
 public:
  /// `shared` must remain valid until Stop. The protocol of the listener's framing must be loaded
  /// and must have a carrier.
  SerialListener(asio::io_context& io, config::Listener listener, ServerShared& shared);
  ~SerialListener() { Stop(); }

  /// Starts opening the port. A port that is absent or cannot be opened is tried again until Stop.
  void Open() { port_.Start(); }
  /// Ends the session: no more bytes are received or sent. The port stays open.
  void Leave();
  /// Closes the port, which can take long in its driver. After Leave, any thread may call
  /// ClosePort, but the listener must be destroyed on the server's thread.
  void ClosePort() { port_.Stop(); }
  void Stop();

  std::string Summary() const { return "a Modbus master on " + listener_.path; }

 private:
  void OnOpened(const std::string& description) override;
  void OnDown(const std::string& reason, bool is_news) override;
  void OnBytes(View bytes, Instant at) override;

  void Send(Bytes frame) override { port_.Send(std::move(frame)); }
  void Rearm() override;

  const config::Listener listener_;
  ServerShared& shared_;
  TrafficBook& book_;
  transports::PortThread port_;
  const std::size_t place_;
  bool left_ = false;
  asio::steady_timer timer_;
  std::optional<MasterSession> session_;
};

}  // namespace baudgate::modbus
