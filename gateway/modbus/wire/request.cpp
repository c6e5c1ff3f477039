// Checks of Modbus requests: function, counts, limits and the length of the whole frame.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/wire/request.h"

namespace baudgate::modbus {
namespace {

ExceptionCode ParseRead(ByteReader pdu, std::size_t limit, ModbusRequest& request) {
  const auto count = pdu.U16Be(3);
  if (pdu.size() != 5 || *count == 0 || *count > limit) return ExceptionCode::illegal_value;
  request.count = *count;
  return ExceptionCode::none;
}

ExceptionCode ParseSingleWrite(ByteReader pdu, ModbusRequest& request) {
  const auto data = pdu.Slice(3, 2);
  if (pdu.size() != 5) return ExceptionCode::illegal_value;
  request.count = 1;
  request.data = *data;
  if (request.function == Function::write_coil) {
    const std::uint16_t value = *pdu.U16Be(3);
    if (value != 0xFF00 && value != 0x0000) return ExceptionCode::illegal_value;
  }
  return ExceptionCode::none;
}

ExceptionCode ParseMultipleWrite(ByteReader pdu, std::size_t limit, ModbusRequest& request) {
  const auto count = pdu.U16Be(3);
  const auto bytes = pdu.U8(5);
  if (!count || !bytes || *count == 0 || *count > limit) return ExceptionCode::illegal_value;
  const std::size_t needed = request.table() == config::Table::bits
                                 ? (static_cast<std::size_t>(*count) + 7) / 8
                                 : static_cast<std::size_t>(*count) * 2;
  if (*bytes != needed || pdu.size() != 6 + needed) return ExceptionCode::illegal_value;
  request.count = *count;
  request.data = *pdu.Slice(6, needed);
  return ExceptionCode::none;
}

ExceptionCode ParseByFunction(ByteReader pdu, ModbusRequest& request) {
  switch (request.function) {
    case Function::read_coils:
    case Function::read_discrete_inputs:
      return ParseRead(pdu, kMaxReadBits, request);
    case Function::read_holding_registers:
    case Function::read_input_registers:
      return ParseRead(pdu, kMaxReadRegisters, request);
    case Function::write_coil:
    case Function::write_register:
      return ParseSingleWrite(pdu, request);
    case Function::write_coils:
      return ParseMultipleWrite(pdu, kMaxWriteBits, request);
    case Function::write_registers:
      return ParseMultipleWrite(pdu, kMaxWriteRegisters, request);
  }
  return ExceptionCode::illegal_function;
}

}  // namespace

bool IsWrite(std::uint8_t function) {
  switch (static_cast<Function>(function)) {
    case Function::write_coil:
    case Function::write_register:
    case Function::write_coils:
    case Function::write_registers:
      return true;
    default:
      return false;
  }
}

bool Permits(config::Permit permit, std::uint8_t function) {
  constexpr std::uint8_t kLastRead = 4;
  constexpr std::uint8_t kLastSingleWrite = 6;
  switch (permit) {
    case config::Permit::read:
      return function >= 1 && function <= kLastRead;
    case config::Permit::data:
      return (function >= 1 && function <= kLastSingleWrite) ||
             function == static_cast<std::uint8_t>(Function::write_coils) ||
             function == static_cast<std::uint8_t>(Function::write_registers);
    case config::Permit::all:
      return true;
  }
  return false;
}

ExceptionCode ParseRequest(View frame, ModbusRequest& request) {
  const ByteReader pdu(frame.subspan(kMbapHeader));
  request.frame = frame;
  request.unit = UnitOf(frame);
  request.function = static_cast<Function>(frame[kMbapHeader]);
  request.start = pdu.U16Be(1).value_or(0);
  const ExceptionCode exception = ParseByFunction(pdu, request);
  if (exception != ExceptionCode::none) return exception;
  // A range that leaves the 65536 addresses names at least one that is not mapped.
  if (request.start + request.count > 0x10000) return ExceptionCode::illegal_address;
  return ExceptionCode::none;
}

std::size_t ReplySize(const ModbusRequest& request) {
  constexpr std::size_t kWriteReply = kMbapHeader + 5;
  constexpr std::size_t kReadHeader = kMbapHeader + 2;
  if (IsWrite(request.frame)) return kWriteReply;
  const std::size_t count = request.count;
  return kReadHeader + (request.table() == config::Table::bits ? (count + 7) / 8 : count * 2);
}

std::array<std::uint8_t, 9> ExceptionReply(View frame, ExceptionCode code) {
  const auto function = static_cast<std::uint8_t>(frame[kMbapHeader] | 0x80U);
  return {frame[0], frame[1], 0, 0, 0, 3, UnitOf(frame), function, static_cast<std::uint8_t>(code)};
}

}  // namespace baudgate::modbus
