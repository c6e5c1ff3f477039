// `Responder` encodes replies to reads. Its buffers contain the requested registers or bits, which
// gateway/outputs/modbus/service/own_units.cpp fills before. libmodbus encodes a reply that is sent
// directly to a client's socket. libmodbus can write to sockets only, so Append encodes a reply for
// a client's output buffer (TLS, RTU, ASCII, replies that wait) itself. Only checked requests may
// be passed, because modbus_reply sleeps after a malformed request, or trusts its wrong length.
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
    would_block,  ///< the socket's buffer was full; no byte was sent
    cut,  ///< a part of the reply was sent; its size is unknown, so the connection must be closed
    failed,
  };

  Responder();
  ~Responder();
  Responder(const Responder&) = delete;
  Responder& operator=(const Responder&) = delete;

  /// An error: libmodbus could not be created. No other function may be called then.
  const Status& ready() const { return ready_; }

  /// The caller writes the contents of the next reply here: request.count registers or bits (one
  /// byte each).
  std::span<std::uint16_t> registers() { return registers_; }
  std::span<std::uint8_t> bits() { return bits_; }

  /// Sends the reply directly to `socket`, which must be connected and non-blocking.
  Sent Send(const ModbusRequest& request, int socket);
  /// Appends the reply to `out`, byte for byte as Send sends it.
  void Append(const ModbusRequest& request, Bytes& out) const;

 private:
  struct Library;

  int Reply(const ModbusRequest& request, int socket);

  std::array<std::uint16_t, kMostRegisters> registers_{};
  std::array<std::uint8_t, kMostBits> bits_{};
  std::unique_ptr<Library> library_;
  Status ready_;
};

}  // namespace baudgate::modbus
