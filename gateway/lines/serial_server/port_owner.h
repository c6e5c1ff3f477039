// What a server of a port and the line that the port belongs to say to each other, on the loop of
// the line. Implemented by gateway/daemon (the line) and server.h.
//
//   the client's first byte   Want       from the server to the line
//   its answer                Grant, or TakeBack
//   the client leaves         Return     from the server to the line
//   the time is over          TakeBack   from the line to the server
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "config/model/port_server.h"
#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "transports/transport.h"

namespace baudgate::serial_server {

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
  virtual void Grant(Transport& port, const config::SerialSettings& serial, Now now) = 0;
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

}  // namespace baudgate::serial_server
