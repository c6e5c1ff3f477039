// One Modbus request, checked byte for byte before anything acts on it; pure.
// Frames come from mbap.h; checked requests go to point_desk.h.
// Rules: MODBUS Application Protocol 1.1b3, 6.1-6.6, 6.11, 6.12 and 7.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "config/model/listener.h"
#include "config/model/point.h"
#include "gateway/base/bytes.h"
#include "gateway/modbus/wire/mbap.h"

namespace baudgate::modbus {

enum class ExceptionCode : std::uint8_t {
  none = 0x00,
  illegal_function = 0x01,  ///< function unknown, or writing denied
  illegal_address = 0x02,   ///< not mapped, or read-only
  illegal_value = 0x03,     ///< count, limit, or part of a value
  device_failure = 0x04,    ///< the device refused
  busy = 0x06,              ///< command queue full
  gateway_path = 0x0A,      ///< unit not mapped
  gateway_target = 0x0B,    ///< device not answering, or value too old
};

enum class Function : std::uint8_t {
  read_coils = 1,
  read_discrete_inputs = 2,
  read_holding_registers = 3,
  read_input_registers = 4,
  write_coil = 5,
  write_register = 6,
  write_coils = 15,
  write_registers = 16,
};

inline constexpr std::size_t kMaxReadBits = 2000;
inline constexpr std::size_t kMaxReadRegisters = 125;
inline constexpr std::size_t kMaxWriteBits = 1968;
inline constexpr std::size_t kMaxWriteRegisters = 123;

struct ModbusRequest {
  View frame;  ///< header included; valid as long as the frame is
  std::uint8_t unit = 0;
  Function function = Function::read_coils;
  std::uint16_t start = 0;
  std::uint16_t count = 0;  ///< 1 for the single writes
  View data;  ///< of writes: the registers or packed bits; FC 5 and 6: their two bytes

  config::Table table() const {
    const bool bits = function == Function::read_coils ||
                      function == Function::read_discrete_inputs ||
                      function == Function::write_coil || function == Function::write_coils;
    return bits ? config::Table::bits : config::Table::registers;
  }
};

/// The unit that a whole frame is for.
inline std::uint8_t UnitOf(View frame) { return frame[kMbapHeader - 1]; }
inline std::uint8_t FunctionOf(View frame) { return frame[kMbapHeader]; }
/// 5, 6, 15 and 16: the functions that unit 0 makes a broadcast.
bool IsWrite(std::uint8_t function);
/// Of a whole frame, well formed or not.
inline bool IsWrite(View frame) { return IsWrite(FunctionOf(frame)); }
/// Whether clients with this permission may ask for the function.
bool Permits(config::Permit permit, std::uint8_t function);

/// Fills `request` from a whole frame (MbapAssembler::Take), or says with which exception to
/// answer.
ExceptionCode ParseRequest(View frame, ModbusRequest& request);

/// Bytes of the whole frame that answers a checked request.
std::size_t ReplySize(const ModbusRequest& request);

/// The nine bytes that answer `frame` with an exception.
std::array<std::uint8_t, 9> ExceptionReply(View frame, ExceptionCode code);

}  // namespace baudgate::modbus
