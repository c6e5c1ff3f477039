// The port of a line for clients over the network: served all the time where the gateway asks
// nobody (`serial_server:`), lent now and then where it does (`lend:`).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "config/model/fields.h"
#include "config/model/mark.h"
#include "config/model/network.h"
#include "gateway/base/time.h"

namespace baudgate::config {

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
  std::string Place() const;
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

}  // namespace baudgate::config
