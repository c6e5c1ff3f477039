// A serial port at which a Modbus master waits for its slaves: the port, its timer and the
// clock. What is said there goes to MasterSession. ReplyEcho recognises the echo of the gateway's
// own replies.
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

// Knows the gateway's own replies in what a two-wire adapter hears, on the side of the slave: the
// reply to a write of one register equals its request, and carrying it out would never end.
// Sans-I/O; used by MasterSession.

/// strip: bytes that repeat the last reply are taken out where they come first, whenever that is.
/// off: bytes pass. Both: the first whole frame after a reply is its echo when it equals the reply
/// and has ended in time. So an echo behind noise is found as well.
class ReplyEcho {
 public:
  /// An adapter, its driver and a busy machine give back what was sent within this time and the
  /// time that it takes on the line.
  static constexpr Duration kLatest = 50ms;

  explicit ReplyEcho(config::Listener::Echo mode)
      : strips_(mode == config::Listener::Echo::strip) {}

  /// Before the reply goes out. `until`: when the last byte of its echo has come at the latest.
  void OnSent(View reply, Instant until);
  /// What is left of bytes that have come, in order.
  Bytes Filter(View received);
  /// Bytes have arrived that look like the start of an echo.
  bool holding() const { return strips_ && filter_.holding(); }
  /// The bus has fallen silent: gives back what was held.
  Bytes OnSilence() { return filter_.OnExchangeEnd().bytes; }
  /// Whether a whole frame among what is left is the echo. `ended`: when its last byte came.
  bool IsEcho(View frame, Instant ended);

 private:
  bool strips_;
  bus::EchoFilter filter_{config::Echo::strip};
  Bytes owed_;  ///< the last reply; empty once a frame or its whole echo has come
  Instant until_;
};

// What a serial master asks and is answered while a port is open. Bytes come from SerialListener,
// which has the port and the clock; requests go to gateway/outputs/modbus/service/client_requests.h
// in their Modbus TCP form, and its answers go back as frames of the serial line. Other slaves may
// answer on the same bus.

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
  const Duration quiet_;  ///< 3.5 characters: between a request and its reply
  const Duration gap_;    ///< a frame that rests so long is not going on

  ClientRequests requests_;
  protocols::Assembler assembler_;
  ReplyEcho echo_;
  Bytes heard_;  ///< since the last silence or request, as much as is looked at
  Instant last_byte_;
  std::uint16_t transaction_ = 0;         // of the last request
  std::optional<std::uint16_t> awaited_;  // the one that the master waits for
  Bytes reply_;                           // waits for the quiet before it
};

/// All on the server's thread. Made by make_shared.
class SerialListener final : public std::enable_shared_from_this<SerialListener>,
                             private transports::PortThread::Owner,
                             public MasterSession::Owner {
 public:
  /// `shared` outlives the listener until Stop. See MasterSession for the protocol.
  SerialListener(asio::io_context& io, config::Listener listener, ServerShared& shared);
  ~SerialListener() { Stop(); }

  /// A port that is absent or cannot be opened is tried again until Stop.
  void Open() { port_.Start(); }
  /// Nothing is heard or answered any more; the port is still open.
  void Leave();
  /// Closes the port, which may take its driver long: after Leave from any other thread, too. The
  /// listener is destroyed on the server's thread even then.
  void ClosePort() { port_.Stop(); }
  /// Both.
  void Stop();

  /// "a Modbus master on /dev/ttyS1".
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
  const std::size_t place_;  ///< in the traffic book, once it has its thread
  bool left_ = false;
  asio::steady_timer timer_;              // the session's deadline
  std::optional<MasterSession> session_;  // while the port is open
};

}  // namespace baudgate::modbus
