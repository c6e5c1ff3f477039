// `ModbusClient` is a Modbus TCP client on libmodbus that reconnects by itself.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

struct _modbus;

namespace baudgate::system_test {

constexpr int kNoException = 0;
constexpr int kNoConnection = -1;

template <typename T>
struct Answer {
  std::vector<T> values;
  int exception = kNoException;
  bool ok() const { return exception == kNoException; }
};
using Registers = Answer<std::uint16_t>;
using Bits = Answer<std::uint8_t>;

class ModbusClient {
 public:
  explicit ModbusClient(std::uint16_t port);
  ~ModbusClient();
  ModbusClient(const ModbusClient&) = delete;
  ModbusClient& operator=(const ModbusClient&) = delete;

  Registers Input(int unit, int address, int count);      ///< FC 4
  Registers Holding(int unit, int address, int count);    ///< FC 3
  Bits DiscreteInputs(int unit, int address, int count);  ///< FC 2
  Bits Coils(int unit, int address, int count);           ///< FC 1
  /// The writes return the exception, kNoException or kNoConnection.
  int WriteRegister(int unit, int address, std::uint16_t value);                        ///< FC 6
  int WriteRegisters(int unit, int address, const std::vector<std::uint16_t>& values);  ///< FC 16
  int WriteCoil(int unit, int address, bool value);                                     ///< FC 5

  /// The functions below return nothing unless all registers of the value were read.
  std::optional<float> Float(int unit, int address);
  std::optional<double> Double(int unit, int address);
  std::optional<std::uint16_t> Register(int unit, int address);

 private:
  bool Connect(int unit);
  int Settle(int result);

  _modbus* context_;
  bool connected_ = false;
};

}  // namespace baudgate::system_test
