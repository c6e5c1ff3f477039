// How numbers stand in the registers of status and event blocks: ABCD, and no larger than they fit.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>

namespace baudgate::modbus {

template <typename T>
T Saturated(std::uint64_t number) {
  constexpr std::uint64_t kMost = std::numeric_limits<T>::max();
  return static_cast<T>(std::min(number, kMost));
}

inline void Put32(std::span<std::uint16_t> block, std::size_t at, std::uint32_t number) {
  block[at] = static_cast<std::uint16_t>(number >> 16);
  block[at + 1] = static_cast<std::uint16_t>(number);
}

}  // namespace baudgate::modbus
