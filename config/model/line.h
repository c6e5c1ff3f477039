// A line and its devices. PortServer is the port of a line for clients over the network.
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

// The port of a line for clients over the network: served all the time where the gateway asks
// nobody (`serial_server:`), lent now and then where it does (`lend:`).
struct PortServer {
  enum class Mode : std::uint8_t {
    raw,      ///< bytes as they are
    rfc2217,  ///< telnet, by which a client also sets the port
  };
  /// A client that connects while another one has the port is refused, or waits.
  enum class Busy : std::uint8_t { refuse, wait };
  HostPort at;
  Mode mode = Mode::raw;
  std::vector<Network> allow;  ///< who may connect; empty = everybody: on loopback only
  Busy busy = Busy::refuse;    ///< of a served port
  /// Without a byte in either direction for so long a client loses the port.
  Duration idle = std::chrono::minutes(10);
  Duration time = std::chrono::minutes(30);  ///< of a loan: the longest one client has the port
  Mark mark;

  bool on_loopback() const { return IsLoopback(ReachOf(at.host)); }
  /// "127.0.0.1:4001".
  std::string Address() const;
};

constexpr std::string_view Name(PortServer::Mode mode) {
  return mode == PortServer::Mode::raw ? "raw" : "rfc2217";
}

template <typename Visit>
void VisitFields(const PortServer*, Visit visit) {
  visit(Field<&PortServer::at>());
  visit(Field<&PortServer::mode>());
  visit(Field<&PortServer::allow>());
  visit(Field<&PortServer::busy>());
  visit(Field<&PortServer::idle>());
  visit(Field<&PortServer::time>{"for"});
  visit(Derived<&PortServer::mark>());
}

enum class Echo : std::uint8_t { off, strip, verify };
/// Telegrams by hand that may write.
enum class Ask : std::uint8_t { deny, write };

struct Line {
  std::string name;
  std::string port;  ///< /dev/…, a pty's path, or tcp://host:port
  SerialSettings serial;
  std::string protocol;
  bool tcp = false;  ///< its protocol knows TCP only: `serial` is nobody's setting, and not shown
  Timing timing;     ///< line before gateway
  int retries = 2;   ///< of exchanges that may be repeated
  Echo echo = Echo::off;
  Ask ask = Ask::deny;
  AlarmSetting alarms;  ///< of the line itself; line before gateway
  Options options;
  std::vector<Device> devices;
  std::optional<PortServer> serial_server;  ///< without devices; `protocol` may be empty then
  std::optional<PortServer> lend;           ///< a client may have the port for a while
  Mark mark;

  /// Where clients come for the port; null: nowhere.
  const PortServer* server() const {
    return serial_server ? &*serial_server : lend ? &*lend : nullptr;
  }

  /// Its port is a serial server elsewhere.
  bool is_network() const { return port.starts_with("tcp://"); }
};

template <typename Visit>
void VisitFields(const Line*, Visit visit) {
  visit(Field<&Line::name>());
  visit(Field<&Line::port>());
  visit(Field<&Line::serial>());
  visit(Field<&Line::protocol>());
  visit(Derived<&Line::tcp>());
  visit(Field<&Line::timing>());
  visit(Field<&Line::retries>());
  visit(Field<&Line::echo>());
  visit(Field<&Line::ask>());
  visit(Field<&Line::alarms>());
  visit(Field<&Line::options>());
  visit(Field<&Line::devices>());
  visit(Field<&Line::serial_server>());
  visit(Field<&Line::lend>());
  visit(Derived<&Line::mark>());
}

}  // namespace baudgate::config
