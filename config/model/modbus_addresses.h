// Which unit ids and which addresses inside a unit mean what: a public contract, docs/modbus.md.
// The check of a configuration and the map that serves it read the same numbers here.
//
//   0…8999, 9100…19999   values       for example register 100
//   9000…9099            status block of the unit, its events from 9016
//   N + 20000            quality of the value at N: 20100
//   N + 40000            age of the value at N: 40100
//   N + 60000            select register of the point at N, where it has one: 60100
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace baudgate::config {

/// The last unit id of a device, and the last slave of a line.
inline constexpr std::uint8_t kLastSlave = 247;

inline constexpr std::uint16_t kStatusBlock = 9000;
/// Writable, two registers: the first event to show.
inline constexpr std::uint16_t kEventBlock = 9016;
inline constexpr std::uint16_t kValuesAfterStatus = 9100;
inline constexpr std::uint16_t kValuesEnd = 20000;
inline constexpr std::uint16_t kQualityOffset = 20000;
inline constexpr std::uint16_t kAgeOffset = 40000;
inline constexpr std::uint16_t kSelectOffset = 60000;
/// Points that are selected before they are written lie below.
inline constexpr std::uint16_t kSelectEnd = 5536;
/// Written to the select register.
inline constexpr std::uint16_t kSelectKey = 0xC0DE;

/// Whether a value may take all addresses from `first` to `last`.
constexpr bool IsValueArea(std::uint32_t first, std::uint32_t last) {
  return first <= last &&
         (last < kStatusBlock || (first >= kValuesAfterStatus && last < kValuesEnd));
}

}  // namespace baudgate::config
