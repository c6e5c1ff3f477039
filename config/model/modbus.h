// `Framing` is the framing of Modbus messages: the header of Modbus TCP, or the framing of a serial
// line, which is also used over TCP. The constants of baudgate::config are the unit ids and
// register addresses of the public contract.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace baudgate::modbus {

enum class Framing : std::uint8_t { tcp, rtu, ascii };

constexpr std::string_view Title(Framing framing) {
  constexpr std::array<std::string_view, 3> kTitles = {"Modbus TCP", "Modbus RTU", "Modbus ASCII"};
  return kTitles[static_cast<std::size_t>(framing)];
}

constexpr std::string_view Name(Framing framing) {
  constexpr std::array<std::string_view, 3> kNames = {"tcp", "rtu", "ascii"};
  return kNames[static_cast<std::size_t>(framing)];
}

/// Returns a sentence about a client that uses another framing, with a remedy: "it speaks Modbus
/// RTU, and Modbus TCP is spoken here; …".
std::string ExplainOther(Framing heard, Framing expected);

}  // namespace baudgate::modbus

namespace baudgate::config {

// The meaning of unit ids and of addresses inside a unit: a public contract, docs/modbus.md. The
// check of a configuration and the register map use these numbers.
//
//   0…8999, 9100…19999   values       for example register 100
//   9000…9099            status block of the unit, its events from 9016
//   N + 20000            quality of the value at N: 20100
//   N + 40000            age of the value at N: 40100
//   N + 60000            select register of the point at N, if it has one: 60100

/// The last unit id of a device, and the last slave of a line.
inline constexpr std::uint8_t kLastSlave = 247;

inline constexpr std::uint16_t kStatusBlock = 9000;
/// The address of two writable registers that contain the number of the first event to show.
inline constexpr std::uint16_t kEventBlock = 9016;
inline constexpr std::uint16_t kValuesAfterStatus = 9100;
inline constexpr std::uint16_t kValuesEnd = 20000;
inline constexpr std::uint16_t kQualityOffset = 20000;
inline constexpr std::uint16_t kAgeOffset = 40000;
inline constexpr std::uint16_t kSelectOffset = 60000;
/// Points that must be selected before a write have addresses below this address.
inline constexpr std::uint16_t kSelectEnd = 5536;
/// The value that a client must write to the select register.
inline constexpr std::uint16_t kSelectKey = 0xC0DE;

/// True if a value can occupy all addresses from `first` to `last`.
constexpr bool IsValueArea(std::uint32_t first, std::uint32_t last) {
  return first <= last &&
         (last < kStatusBlock || (first >= kValuesAfterStatus && last < kValuesEnd));
}

}  // namespace baudgate::config
