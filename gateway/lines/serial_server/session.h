// `Session` is one client of a port on one connection: it passes bytes from the client to the port
// and back, each way no faster than the receiver takes them. It has no socket and no clock:
// gateway/lines/serial_server/server.cpp provides these.
//
//   connected → (asks for the port with its first byte or command) → has the port → over
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

// ComPort handles the commands of a client by RFC 2217 (COM-PORT-OPTION): settings, control lines,
// modem and line states, purging, suspension. It has no socket and no clock.
//
//   01 00 00 25 80     SET-BAUDRATE 9600      answered by 65 00 00 25 80: the rate of the port now
//   01 00 00 00 00     a question for the rate, answered in the same way

class ComPort {
 public:
  /// `port` must outlive this object. It has the settings `serial`, and DTR and RTS are on.
  ComPort(transports::Transport& port, const config::SerialSettings& serial, std::string signature);

  /// Executes one command; `command` does not contain the number of the telnet option. Returns the
  /// answer in its telnet form; empty if no answer is needed. If the driver refuses a setting, the
  /// answer contains the old setting.
  Bytes On(View command);
  /// Begins a break, or ends a break that no SET-CONTROL command holds. Returns false if the driver
  /// cannot make a break.
  bool Break(bool on);
  /// Returns notifications of changes at the port since the last call, as far as the client has
  /// asked for notifications.
  Bytes Poll();
  /// True if the client has suspended output: nothing from the port must be sent to the client
  /// then.
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
  const bool software_;  // true: the port supports 8N1 only, and parity is made in software
  const std::string signature_;
  bool dtr_ = true;
  bool rts_ = true;
  bool break_ = false;
  bool suspended_ = false;
  bool greeted_ = false;  // the modem state was sent once
  std::uint8_t modem_mask_ = 0xFF;
  std::uint8_t line_mask_ = 0;
  std::uint8_t modem_ = 0;  // the levels at the last call of ModemState
  transports::PortCounters counters_;
};

// PortUser and PortOwner are the interfaces between a server of a port (serial_server::Server) and
// the line that owns the port (lines::PortLoan). All functions must be called on the loop of the
// line.
//
//   the client's first byte       Want       from the server to the line
//   the reply of the line         Grant, or TakeBack
//   the client leaves             Return     from the server to the line
//   the time of the loan is over  TakeBack   from the line to the server

struct Visit {
  std::string client{};  ///< "10.0.0.7:40112"
  std::string place{};   ///< the address to which the client connected: "127.0.0.1:4001"
  config::PortServer::Mode mode = config::PortServer::Mode::raw;
  Now began{};
  std::uint64_t to_port = 0;
  std::uint64_t from_port = 0;
};

/// PortUser is a server, as the line sees it.
class PortUser {
 public:
  /// Gives the port to the server until Return or TakeBack.
  virtual void Grant(transports::Transport& port, const config::SerialSettings& serial,
                     Now now) = 0;
  /// Disconnects the client. The server must not call Return for it.
  virtual void TakeBack(Now now) = 0;
  virtual void OnPort(View bytes, Now now) = 0;
  virtual void OnPortRoom() = 0;
  /// Returns the visit of the client that has the port or asks for it.
  virtual Visit visit() const = 0;

 protected:
  ~PortUser() = default;
};

/// PortOwner is a line, as its servers see it.
class PortOwner {
 public:
  /// Asks for the port. The reply is one call of Grant or TakeBack, within this call or later,
  /// unless Return comes first.
  virtual void Want(PortUser& user, const Visit& visit, Now now) = 0;
  /// Gives the port back. `why` is a text for users: why the client leaves.
  virtual void Return(PortUser& user, const Visit& visit, const std::string& why, Now now) = 0;
  /// Reports that clients can connect at the address `place`, or, in `trouble`, why they cannot.
  /// The server retries.
  virtual void OnListening(const std::string& place, const std::string& trouble, Now now) = 0;
  /// Reports a client that is not refused when it connects: its address, and the result of its TLS
  /// handshake.
  struct Arrival {
    std::string peer;
    std::string place;      ///< the address of the server, "10.0.0.1:4001"
    bool has_tls = false;   ///< the port is encrypted
    std::string who{};      ///< the owner of the client's certificate; empty: without certificate
    std::string why_not{};  ///< why the handshake failed; empty: the handshake succeeded
  };
  virtual void OnArrival(const Arrival& arrival, Now now) = 0;

 protected:
  ~PortOwner() = default;
};

// PortDrain waits for the last bytes of a client that sends no more: the client leaves when the
// port has sent all its bytes, or after half a minute.
class PortDrain {
 public:
  static constexpr Duration kLookEvery = 10ms;
  static constexpr Duration kLongest = 30s;

  void Begin(Instant now) { since_ = look_at_ = now; }
  bool has_begun() const { return since_.has_value(); }
  /// Returns when to call Look; nothing before Begin.
  std::optional<Instant> Deadline() const { return look_at_; }

  /// Must be called at Deadline(). `is_drained`: the port has sent all bytes. Returns why the
  /// client leaves; nothing if it must wait longer.
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
  /// The connection of the client. Its functions must not call the session.
  class Connection {
   public:
    virtual void Send(View bytes) = 0;
    virtual std::size_t unsent() const = 0;
    virtual void Pause(bool paused) = 0;

   protected:
    ~Connection() = default;
  };

  /// While more than kMostForPort bytes wait for the port, the session reads nothing from the
  /// client. While more than kMostForClient wait for the client, it reads nothing from either side.
  static constexpr std::size_t kMostForPort = 16 * 1024;
  static constexpr std::size_t kMostForClient = 32 * 1024;
  static constexpr Duration kLookEvery = 100ms;  ///< interval for reading the control lines
  /// kBreakLasts is the length of a break that a client requests by IAC BRK. The break begins when
  /// all earlier bytes have left the port, or after kMostBeforeBreak if the device holds them back.
  /// kLookBeforeBreak is the interval between checks whether the bytes have left.
  static constexpr Duration kBreakLasts = 300ms;
  static constexpr Duration kMostBeforeBreak = 1s;
  static constexpr Duration kLookBeforeBreak = 10ms;

  /// `visit.began` is the time of the connection; Begin replaces it. The connection must outlive
  /// the session.
  Session(Visit visit, Duration idle, std::string signature, Connection& connection);

  /// Handles bytes of the client. Before Begin, the session stores them, and the caller must pass
  /// the bytes of one read only.
  void OnClient(View bytes, Now now);
  /// Called when the client sends no more. over() follows when PortDrain ends.
  void OnClientEnd(Now now);
  void OnClientRoom() { Regulate(); }

  /// True if the client has sent something for the port.
  bool asks() const { return asks_; }
  bool has_port() const { return port_ != nullptr; }
  /// Gives the port to the client. `port` has the settings `serial`, and must stay valid until End.
  void Begin(transports::Transport& port, const config::SerialSettings& serial, Now now);
  void OnPort(View bytes, Now now);
  void OnPortRoom() { Regulate(); }
  void End();

  void OnTimer(Now now);
  std::optional<Instant> Deadline() const;
  /// Returns why the client must be disconnected; nothing if it can stay.
  const std::optional<std::string>& over() const { return over_; }

  /// Returns the visit. `began` is the time of Begin, or of the connection before Begin.
  const Visit& visit() const { return visit_; }

 private:
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
  // When the break ends, or when to check whether a requested break can begin. Empty: no break.
  std::optional<Instant> break_at_;
  bool breaks_ = false;
  bool asks_ = false;
  bool port_paused_ = false;
  bool client_paused_ = false;
  Instant heard_;  // time of the last byte in either direction
  std::optional<Instant> look_at_;
  PortDrain drain_;
  std::optional<std::string> over_;
};

}  // namespace baudgate::serial_server
