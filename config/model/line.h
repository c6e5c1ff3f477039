// `Line` is a line with its devices. PortServer is the port of a line for clients over the network.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "config/model/events.h"
#include "config/model/fields.h"
#include "config/model/network.h"
#include "config/model/problem.h"
#include "gateway/base/time.h"

namespace baudgate::config {

// PortServer is the port of a line for clients over the network. With `serial_server:` the clients
// have the port all the time and the gateway polls nothing; with `lend:` the gateway polls, and a
// client can use the port for some time.
struct PortServer {
  enum class Mode : std::uint8_t {
    raw,      ///< bytes are passed unchanged
    rfc2217,  ///< telnet; the client can also change the port's settings
  };
  enum class Busy : std::uint8_t { refuse, wait };
  HostPort at;
  Mode mode = Mode::raw;
  /// Empty: everybody, which is allowed only if `at` is a loopback address.
  std::vector<Network> allow;
  Busy busy = Busy::refuse;
  Duration idle = std::chrono::minutes(10);
  Duration time = std::chrono::minutes(30);
  TlsFiles tls;  ///< `authorities` is empty: clients need no certificate
  Mark mark;

  bool on_loopback() const { return IsLoopback(ReachOf(at.host)); }
  std::string Address() const;
};

template <typename Visit>
void VisitFields(const PortServer*, Visit visit) {
  visit(Field<&PortServer::at>{.help = "address and TCP port of this machine",
                               .fallback = kRequired});
  visit(Field<&PortServer::mode>{.help = "raw: bytes unchanged; rfc2217: telnet, by which a client "
                                         "can also set bit rate and format"});
  visit(Field<&PortServer::allow>{
      .help = "addresses and networks that may connect; required unless at is a loopback address",
      .fallback = "everybody"});
  visit(Field<&PortServer::idle>{
      "idle", "a client that transfers no byte for this time loses the port", 1s, 24h});
  visit(Field<&PortServer::busy>{
      .help = "serial_server only: a client that connects while another client uses the port is "
              "refused, or waits (at most seven wait)"});
  visit(Field<&PortServer::time>{
      "for", "lend only: the longest time that a client can use the port", 1s, 24h});
  visit(Field<&PortServer::tls>{.key = "certificate",
                                .help = "file: the certificate for TLS, with its chain",
                                .fallback = "no TLS"});
  visit(Key{"key", "file: the key of the certificate, mode 0640 or less"});
  visit(Key{"client_ca",
            "file: only clients with a certificate of this authority may connect",
            {},
            "every client"});
  visit(Derived<&PortServer::mark>());
}

enum class Echo : std::uint8_t { off, strip, verify };
enum class Ask : std::uint8_t { deny, write };

struct Line {
  std::string name;
  std::string port;
  TlsFiles tls;  ///< for a port "tls://…"
  SerialSettings serial;
  std::string protocol;
  bool tcp = false;  ///< the protocol runs over TCP only: `serial` is unused and not shown
  Timing timing;     ///< times of the line, completed by those of the gateway
  int retries = 2;   ///< for exchanges that may be repeated
  Echo echo = Echo::off;
  Ask ask = Ask::deny;
  AlarmSetting alarms;  ///< for alarms of the line itself; takes precedence over the gateway's
  Options options;
  std::vector<Device> devices;
  /// Clients have the port all the time. The line then has no devices, and `protocol` may be empty.
  std::optional<PortServer> serial_server;
  std::optional<PortServer> lend;  ///< a client can use the port for some time
  Mark mark;

  const PortServer* server() const {
    return serial_server ? &*serial_server : lend ? &*lend : nullptr;
  }

  /// True if the port is a serial server, reached over TCP.
  bool is_network() const { return IsNetworkPort(port); }
};

template <typename Visit>
void VisitFields(const Line*, Visit visit) {
  visit(Field<&Line::name>{.help = "letters, digits, single - or _", .fallback = kRequired});
  visit(Field<&Line::port>{
      .help = "/dev/…, a pty's path, or tcp://host:port or tls://host:port for a serial server",
      .fallback = kRequired});
  visit(Field<&Line::tls>{.key = "ca",
                          .help = "tls:// only: file with the authority of the server",
                          .fallback = "required with tls://"});
  visit(Key{
      "certificate", "tls:// only: file with the certificate that the gateway shows", {}, "none"});
  visit(Key{"key", "tls:// only: file with the key of the certificate", {}, "none"});
  visit(Field<&Line::serial>{.help = "\"9600 7E1\": bit/s, data bits, parity (N, E, O, M, S), stop "
                                     "bits; or a map",
                             .fallback = "the protocol's"});
  visit(Key{"parity", "who makes parity bits; software: for ports that support 8N1 only",
            "hardware, software", "hardware"});
  visit(Key{"rs485", "a map, below"});
  visit(Field<&Line::protocol>{.help = "a name from `baudgate protocols`",
                               .fallback = "required, unless the line has serial_server"});
  visit(Derived<&Line::tcp>());
  visit(Field<&Line::timing>());
  visit(Field<&Line::retries>());
  visit(Field<&Line::echo>{
      .help =
          "the adapter returns sent bytes; verify: every request must come back, as in a ring"});
  visit(Field<&Line::ask>{.help = "whether telegrams of `baudgate ask` may write"});
  visit(Field<&Line::alarms>{.help = "alarms of the line and its devices, below",
                             .fallback = "the gateway's"});
  visit(Field<&Line::options>());
  visit(Field<&Line::devices>{.help = "a list of devices, below"});
  visit(Field<&Line::serial_server>{
      .help = "offers the port over the network all the time; the gateway does not poll it"});
  visit(Field<&Line::lend>{.help = "offers the port over the network, for a limited time"});
  visit(Derived<&Line::mark>());
}

}  // namespace baudgate::config
