// SPDX-License-Identifier: Apache-2.0
#include "tests/system/modbus_client.h"

#include <modbus/modbus.h>

#include <bit>
#include <cerrno>

namespace baudgate::system_test {
namespace {

constexpr std::uint32_t kPatienceSeconds = 10;

}  // namespace

ModbusClient::ModbusClient(std::uint16_t port) : context_(modbus_new_tcp("127.0.0.1", port)) {
  modbus_set_response_timeout(context_, kPatienceSeconds, 0);
}

ModbusClient::~ModbusClient() {
  if (connected_) modbus_close(context_);
  modbus_free(context_);
}

bool ModbusClient::Connect(int unit) {
  if (!connected_) connected_ = modbus_connect(context_) == 0;
  return connected_ && modbus_set_slave(context_, unit) == 0;
}

/// libmodbus reports an exception as a number above MODBUS_ENOBASE. Other numbers are connection
/// errors.
int ModbusClient::Settle(int result) {
  if (result >= 0) return kNoException;
  const int code = errno - MODBUS_ENOBASE;
  if (code > 0 && code < MODBUS_EXCEPTION_MAX) return code;
  modbus_close(context_);
  connected_ = false;
  return kNoConnection;
}

Registers ModbusClient::Input(int unit, int address, int count) {
  Registers answer{std::vector<std::uint16_t>(static_cast<std::size_t>(count)), kNoConnection};
  if (!Connect(unit)) return answer;
  answer.exception =
      Settle(modbus_read_input_registers(context_, address, count, answer.values.data()));
  return answer;
}

Registers ModbusClient::Holding(int unit, int address, int count) {
  Registers answer{std::vector<std::uint16_t>(static_cast<std::size_t>(count)), kNoConnection};
  if (!Connect(unit)) return answer;
  answer.exception = Settle(modbus_read_registers(context_, address, count, answer.values.data()));
  return answer;
}

Bits ModbusClient::DiscreteInputs(int unit, int address, int count) {
  Bits answer{std::vector<std::uint8_t>(static_cast<std::size_t>(count)), kNoConnection};
  if (!Connect(unit)) return answer;
  answer.exception = Settle(modbus_read_input_bits(context_, address, count, answer.values.data()));
  return answer;
}

Bits ModbusClient::Coils(int unit, int address, int count) {
  Bits answer{std::vector<std::uint8_t>(static_cast<std::size_t>(count)), kNoConnection};
  if (!Connect(unit)) return answer;
  answer.exception = Settle(modbus_read_bits(context_, address, count, answer.values.data()));
  return answer;
}

int ModbusClient::WriteRegister(int unit, int address, std::uint16_t value) {
  return Connect(unit) ? Settle(modbus_write_register(context_, address, value)) : kNoConnection;
}

int ModbusClient::WriteRegisters(int unit, int address, const std::vector<std::uint16_t>& values) {
  if (!Connect(unit)) return kNoConnection;
  return Settle(
      modbus_write_registers(context_, address, static_cast<int>(values.size()), values.data()));
}

int ModbusClient::WriteCoil(int unit, int address, bool value) {
  return Connect(unit) ? Settle(modbus_write_bit(context_, address, value)) : kNoConnection;
}

std::optional<float> ModbusClient::Float(int unit, int address) {
  const Registers answer = Input(unit, address, 2);
  if (!answer.ok()) return std::nullopt;
  return modbus_get_float_abcd(answer.values.data());
}

std::optional<double> ModbusClient::Double(int unit, int address) {
  const Registers answer = Input(unit, address, 4);
  if (!answer.ok()) return std::nullopt;
  std::uint64_t whole = 0;
  for (const std::uint16_t part : answer.values) whole = whole << 16U | part;
  return std::bit_cast<double>(whole);
}

std::optional<std::uint16_t> ModbusClient::Register(int unit, int address) {
  const Registers answer = Input(unit, address, 1);
  if (!answer.ok()) return std::nullopt;
  return answer.values[0];
}

}  // namespace baudgate::system_test
