// One client of a port, over one connection: what it sends goes to the port, what the port receives
// goes to it, each no faster than the other side takes it. Sans-I/O: bytes and time come in as
// arguments, the port is a transport, and the connection is server.cpp's.
//
//   connected → (asks for the port with its first byte or command) → has the port → over
//
// ComPort is what a client asks of the port by RFC 2217. PortOwner and PortUser are what a server
// and the line say to each other, and PortDrain waits until a client's last bytes are sent.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "config/model/line.h"
#include "config/model/serial.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "gateway/lines/serial_server/telnet.h"
#include "transports/transport.h"

namespace baudgate::serial_server {

// What a client asks of the port by RFC 2217 (COM-PORT-OPTION), and what it is told: settings,
// control lines, modem and line states, purging, suspension. The port is a transport; sockets
// are server.cpp's, times session.cpp's.
//
//   01 00 00 25 80     SET-BAUDRATE 9600      answered by 65 00 00 25 80: what the port does now
//   01 00 00 00 00     the same as a question
//

class ComPort {
 public:
  /// `port` is set to `serial`, its control lines are on; it outlives this.
  ComPort(transports::Transport& port, const config::SerialSettings& serial, std::string signature);

  /// One command, without the number of the option. The answer, in its telnet form; empty: none is
  /// due. What the driver refuses stays as it was, and the answer says so.
  Bytes On(View command);
  /// Begins a break, or ends it where no SET-CONTROL command has asked for one. False: the driver
  /// makes none.
  bool Break(bool on);
  /// What has changed at the port since the last call, as far as the client wants to hear it.
  Bytes Poll();
  /// The client has asked for silence: nothing from the port is sent to it.
  bool suspended() const { return suspended_; }

 private:
  Bytes SetBaud(View value);
  Bytes SetOne(std::uint8_t command, std::uint8_t value);
  Bytes SetControl(std::uint8_t value);
  std::uint8_t Flow(std::uint8_t ask, std::uint8_t value);
  std::uint8_t Switch(transports::PortSwitch which, bool& state, std::uint8_t ask,
                      std::uint8_t value);
  void Try(const config::SerialSettings& wanted);
  std::uint8_t ParityCode() const;
  std::uint8_t StopCode() const;
  std::uint8_t ModemState();
  std::uint8_t LineState();
  Bytes Purge(std::uint8_t what);
  Bytes NotifyModem(std::uint8_t state) const;

  transports::Transport& port_;
  config::SerialSettings serial_;
  const bool software_;  // the port knows 8N1 only
  const std::string signature_;
  bool dtr_ = true;
  bool rts_ = true;
  bool break_ = false;
  bool suspended_ = false;
  bool greeted_ = false;  // it knows the modem state
  std::uint8_t modem_mask_ = 0xFF;
  std::uint8_t line_mask_ = 0;
  std::uint8_t modem_ = 0;  // levels, as told last
  transports::PortCounters counters_;
};

// What a server of a port and the line that the port belongs to say to each other, on the loop of
// the line. Implemented by gateway/lines (the line) and server.h.
//
//   the client's first byte   Want       from the server to the line
//   its answer                Grant, or TakeBack
//   the client leaves         Return     from the server to the line
//   the time is over          TakeBack   from the line to the server

/// A client that has the port, or had it.
struct Visit {
  std::string client{};  ///< "10.0.0.7:40112"
  std::string place{};   ///< where it has come in: "127.0.0.1:4001"
  config::PortServer::Mode mode = config::PortServer::Mode::raw;
  Now began{};
  std::uint64_t to_port = 0;  ///< bytes, as below
  std::uint64_t from_port = 0;
};

/// A server, to its line.
class PortUser {
 public:
  /// Until Return, or TakeBack.
  virtual void Grant(transports::Transport& port, const config::SerialSettings& serial,
                     Now now) = 0;
  /// Its client is disconnected. Return does not follow.
  virtual void TakeBack(Now now) = 0;
  virtual void OnPort(View bytes, Now now) = 0;
  virtual void OnPortRoom() = 0;
  /// While it has the port.
  virtual Visit visit() const = 0;

 protected:
  ~PortUser() = default;
};

/// A line, to its servers.
class PortOwner {
 public:
  /// The answer is one call of Grant or TakeBack, from within or later, unless Return comes first.
  virtual void Want(PortUser& user, const Visit& visit, Now now) = 0;
  /// `why`: the client has left, or it is to leave.
  virtual void Return(PortUser& user, const Visit& visit, const std::string& why, Now now) = 0;
  /// Clients can come in at `place`; otherwise `trouble` says why not, and it is tried again.
  virtual void OnListening(const std::string& place, const std::string& trouble, Now now) = 0;

 protected:
  ~PortOwner() = default;
};

// A client sends no more: it leaves when the port has sent what it got from the client, or after
// half a minute. Time is an argument.
class PortDrain {
 public:
  static constexpr Duration kLookEvery = 10ms;
  static constexpr Duration kLongest = 30s;

  void Begin(Instant now) { since_ = look_at_ = now; }
  bool has_begun() const { return since_.has_value(); }
  /// When to look at the port next; empty: the client still sends.
  std::optional<Instant> Deadline() const { return look_at_; }

  /// At the deadline. `is_drained`: the port has sent everything. Returns why the client leaves;
  /// empty: not yet.
  std::optional<std::string> Look(bool is_drained, Instant now) {
    look_at_ = now + kLookEvery;
    if (now - *since_ >= kLongest) {
      return "it disconnected before the port had taken all its bytes";
    }
    if (is_drained) return "it disconnected";
    return std::nullopt;
  }

 private:
  std::optional<Instant> since_;
  std::optional<Instant> look_at_;
};

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
  void Begin(transports::Transport& port, const config::SerialSettings& serial, Now now);
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
  transports::Transport* port_ = nullptr;
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
