// How Modbus messages are framed: by the header of Modbus TCP, or as on a serial line, there and
// over TCP.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace baudgate::modbus {

enum class Framing : std::uint8_t { tcp, rtu, ascii };

/// "Modbus RTU".
constexpr std::string_view Title(Framing framing) {
  constexpr std::array<std::string_view, 3> kTitles = {"Modbus TCP", "Modbus RTU", "Modbus ASCII"};
  return kTitles[static_cast<std::size_t>(framing)];
}

/// "rtu", as the configuration has it.
constexpr std::string_view Name(Framing framing) {
  constexpr std::array<std::string_view, 3> kNames = {"tcp", "rtu", "ascii"};
  return kNames[static_cast<std::size_t>(framing)];
}

/// A sentence on a client with another framing: "it speaks Modbus RTU, and Modbus TCP is spoken
/// here; …".
std::string ExplainOther(Framing heard, Framing expected);

}  // namespace baudgate::modbus
