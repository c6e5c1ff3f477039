// `Responder` encodes the replies to checked requests with libmodbus, from a private copy of the
// registers or bits that were asked for. gateway/outputs/modbus/service/own_units.cpp fills the
// copy. Replies go straight to a client's socket, or through a socket pair to its output buffer.
// Only well-formed requests may come here: on others modbus_reply sleeps, or trusts lengths that it
// should not.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/outputs/modbus/wire/request.h"

namespace baudgate::modbus {

class Responder {
 public:
  enum class Sent : std::uint8_t {
    whole,
    would_block,  ///< the socket's buffer was full; nothing was sent
    cut,          ///< a part was sent; its size is unknown, so the connection must be closed
    failed,       ///< the connection has ended
  };

  Responder();
  ~Responder();
  Responder(const Responder&) = delete;
  Responder& operator=(const Responder&) = delete;

  /// The error: why libmodbus or the socket pair is missing. No other function may be called then.
  const Status& ready() const { return ready_; }

  /// The private copy: request.count registers or bits (one byte each) of the next reply.
  std::span<std::uint16_t> registers() { return registers_; }
  std::span<std::uint8_t> bits() { return bits_; }

  /// Sends the reply straight to a connected, non-blocking socket.
  Sent Send(const ModbusRequest& request, int socket);
  /// Appends the reply to `out`. False when the kernel has no memory for it.
  bool Append(const ModbusRequest& request, Bytes& out);

 private:
  struct Library;

  int Reply(const ModbusRequest& request, int socket);

  std::array<std::uint16_t, kMostRegisters> registers_{};
  std::array<std::uint8_t, kMostBits> bits_{};
  std::unique_ptr<Library> library_;
  std::array<int, 2> pair_{-1, -1};
  Status ready_;
};

}  // namespace baudgate::modbus
