// Where Modbus masters come in, and what they may do.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/fields.h"
#include "config/model/mark.h"
#include "config/model/modbus_framing.h"
#include "config/model/network.h"
#include "config/model/serial.h"
#include "gateway/base/time.h"

namespace baudgate::config {

enum class Priority : std::uint8_t { low, normal, high };

/// What a listener's clients may ask for. Others get exception 0x01.
enum class Permit : std::uint8_t {
  read,  ///< functions 1-4
  data,  ///< functions 1-6, 15 and 16
  all,
};

/// Clients of some addresses have a priority of their own; the first that fits decides.
struct ClientPriority {
  Network from;
  Priority priority = Priority::normal;
};

template <typename Visit>
void VisitFields(const ClientPriority*, Visit visit) {
  visit(Field<&ClientPriority::from>());
  visit(Field<&ClientPriority::priority>());
}

/// So have some functions, whoever asks: over the client's and the listener's.
struct FunctionPriority {
  std::vector<std::uint8_t> codes;
  Priority priority = Priority::normal;
};

template <typename Visit>
void VisitFields(const FunctionPriority*, Visit visit) {
  visit(Field<&FunctionPriority::codes>());
  visit(Field<&FunctionPriority::priority>());
}

/// Where Modbus masters come in: a TCP port, or a serial port at which a master waits.
struct Listener {
  enum class Errors : std::uint8_t {
    exception,  ///< 0x0A, 0x0B and 0x06 are answered
    silent,     ///< nothing is answered in their place
  };
  /// What becomes of a write to unit 0 that no route names.
  enum class Broadcast : std::uint8_t {
    ignore,  ///< it is for the gateway, which has nothing to write: exception 0x02
    pass,    ///< to all slaves of every line that a route leads to; never answered
  };
  /// What a read of a block finds at addresses between points.
  enum class Holes : std::uint8_t {
    off,   ///< exception 0x02
    zero,  ///< 0, where the block has a point at all
  };
  /// Whether the adapter at the serial port gives the gateway its own replies back as requests.
  enum class Echo : std::uint8_t { off, strip };
  std::string host = "127.0.0.1";
  std::uint16_t port = 1502;
  std::string path;       ///< of the serial port; then host and port mean nothing
  SerialSettings serial;  ///< of the serial port
  Echo echo = Echo::off;  ///< of the serial port
  modbus::Framing framing = modbus::Framing::tcp;  ///< of a serial port: rtu or ascii
  std::vector<Network> allow;                      ///< empty = everybody
  Permit permit = Permit::all;
  Priority priority = Priority::normal;
  std::vector<ClientPriority> clients;
  std::vector<FunctionPriority> functions;
  Errors errors = Errors::exception;  ///< the loader makes it silent for serial ports
  Broadcast broadcast = Broadcast::ignore;
  Holes holes = Holes::off;
  int max_clients = 256;
  Duration idle_timeout = std::chrono::minutes(5);
  Mark mark;

  bool is_serial() const { return !path.empty(); }
  /// Messages as on a serial line: they do not tell which request they answer, so there is one at a
  /// time.
  bool speaks_serial() const { return framing != modbus::Framing::tcp; }
  /// "0.0.0.0:502", "[::1]:502" or "/dev/ttyS1".
  std::string Place() const;
};

template <typename Visit>
void VisitFields(const Listener*, Visit visit) {
  visit(Field<&Listener::host>());
  visit(Field<&Listener::port>());
  visit(Field<&Listener::path>());
  visit(Field<&Listener::serial>());
  visit(Field<&Listener::echo>());
  visit(Field<&Listener::framing>());
  visit(Field<&Listener::allow>());
  visit(Field<&Listener::permit>{"write"});
  visit(Field<&Listener::priority>());
  visit(Field<&Listener::clients>());
  visit(Field<&Listener::functions>());
  visit(Field<&Listener::errors>());
  visit(Field<&Listener::broadcast>());
  visit(Field<&Listener::holes>());
  visit(Field<&Listener::max_clients>());
  visit(Field<&Listener::idle_timeout>());
  visit(Derived<&Listener::mark>());
}

std::string_view Name(Priority priority);
std::string_view Name(Permit permit);

}  // namespace baudgate::config
