// Answers checked requests through libmodbus, from a private copy of exactly what was asked for.
// The copy is filled by gateway/outputs/modbus/service/own_units.cpp; the answers go straight to
// a client's socket, or into its output buffer by way of a socket pair of our own. Only well-formed
// requests may come here: on others modbus_reply sleeps or trusts what it should not.
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
    would_block,  ///< nothing was sent
    cut,          ///< a part was sent; how much is unknown, so the connection cannot go on
    failed,       ///< the connection is gone
  };

  Responder();
  ~Responder();
  Responder(const Responder&) = delete;
  Responder& operator=(const Responder&) = delete;

  /// Says why when libmodbus or the socket pair could not be had; nothing else works then.
  const Status& ready() const { return ready_; }

  /// The private copy: request.count registers or bits, one byte each, of the next answer.
  std::span<std::uint16_t> registers() { return registers_; }
  std::span<std::uint8_t> bits() { return bits_; }

  /// Straight to a connected, non-blocking socket.
  Sent Send(const ModbusRequest& request, int socket);
  /// To the end of `out`. False when the kernel has no memory for it.
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
