// One client of a port, over one connection: what it sends goes to the port, what the port receives
// goes to it, each no faster than the other side takes it. Sans-I/O: bytes and time come in as
// arguments, the port is a transport, and the connection is client_socket.cpp's.
//
//   connected → (asks for the port with its first byte or command) → has the port → over
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/lines/serial_server/com_port.h"
#include "gateway/lines/serial_server/port_drain.h"
#include "gateway/lines/serial_server/port_owner.h"
#include "gateway/lines/serial_server/telnet_stream.h"
#include "transports/transport.h"

namespace baudgate::serial_server {

class Session {
 public:
  /// The connection. None of these calls the session.
  class Connection {
   public:
    virtual void Send(View bytes) = 0;
    virtual std::size_t unsent() const = 0;
    /// Nothing is read from it any more.
    virtual void Pause(bool paused) = 0;

   protected:
    ~Connection() = default;
  };

  /// More than this waits for one side, and the other is not read.
  static constexpr std::size_t kMostForPort = 16 * 1024;
  static constexpr std::size_t kMostForClient = 32 * 1024;
  static constexpr Duration kLookEvery = 100ms;  ///< at the control lines
  /// A break that a client asks for by IAC BRK: as long as other programs make it. It begins when
  /// what was sent before has left the port, but soon where the device holds that back.
  static constexpr Duration kBreakLasts = 300ms;
  static constexpr Duration kMostBeforeBreak = 1s;
  static constexpr Duration kLookBeforeBreak = 10ms;

  /// `visit`: began with the connection, and begins once more with Begin. The connection outlives
  /// the session.
  Session(Visit visit, Duration idle, std::string signature, Connection& connection);

  /// From the client; at most what one read gives, until it has the port.
  void OnClient(View bytes, Now now);
  /// The client sends no more: it leaves when the port has sent what it got.
  void OnClientEnd(Now now);
  void OnClientRoom() { Regulate(); }

  /// It has sent something that needs the port.
  bool asks() const { return asks_; }
  bool has_port() const { return port_ != nullptr; }
  /// The port is the client's. `port` is set to `serial` and outlives its use here.
  void Begin(Transport& port, const config::SerialSettings& serial, Now now);
  void OnPort(View bytes, Now now);
  void OnPortRoom() { Regulate(); }
  /// The port is no more the client's.
  void End();

  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;
  /// Why the client is to be disconnected; empty: it is not.
  const std::optional<std::string>& over() const { return over_; }

  /// Since it has had the port; before that: since its connection.
  const Visit& visit() const { return visit_; }

 private:
  /// What waits for the port.
  using Kind = TelnetStream::Part::Kind;
  struct Waiting {
    Kind kind = Kind::data;
    Bytes bytes;
  };
  void Decode(View bytes, Now now);
  void Take(Kind kind, View bytes, Now now);
  void TakeWaiting(Now now);
  void LookAtBreak(Now now);
  void Regulate();
  bool is_telnet() const { return visit_.mode == config::PortServer::Mode::rfc2217; }

  Visit visit_;
  const Duration idle_;
  const std::string signature_;
  Connection& connection_;
  Transport* port_ = nullptr;
  TelnetStream telnet_;
  std::optional<ComPort> com_;
  std::deque<Waiting> waiting_;
  Instant break_asked_{};
  std::optional<Instant>
      break_at_;  // the break begins or ends, or the port is looked at; empty: none
  bool breaks_ = false;
  bool asks_ = false;
  bool port_paused_ = false;
  bool client_paused_ = false;
  Instant heard_;  // a byte, in either direction
  std::optional<Instant> look_at_;
  PortDrain drain_;
  std::optional<std::string> over_;
};

}  // namespace baudgate::serial_server
