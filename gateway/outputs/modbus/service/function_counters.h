// How often each function was asked at a listener, and how it was answered. The server's thread
// alone counts, without a lock; any thread reads.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gateway/outputs/modbus/service/traffic.h"

namespace baudgate::modbus {

class FunctionCounters {
 public:
  /// `exception`: 0 for none.
  void Add(std::uint8_t function, std::uint8_t exception = 0) {
    constexpr auto kRelaxed = std::memory_order_relaxed;
    auto& counter = counters_[PlaceOf(function)][std::min<std::size_t>(exception, kExceptions - 1)];
    counter.store(counter.load(kRelaxed) + 1, kRelaxed);
  }
  void AppendTo(const std::string& listener, std::vector<FunctionCount>& counts) const {
    for (std::size_t place = 0; place < counters_.size(); ++place) {
      const std::uint8_t function = place < kFunctions.size() ? kFunctions[place] : 0;
      for (std::uint8_t exception = 0; exception < kExceptions; ++exception) {
        const std::uint64_t count = counters_[place][exception].load(std::memory_order_relaxed);
        if (count > 0) counts.push_back({listener, function, exception, count});
      }
    }
  }

 private:
  /// Functions of the standard; all others are counted as one.
  static constexpr std::array<std::uint8_t, 19> kFunctions = {
      1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 17, 20, 21, 22, 23, 24, 43};
  static constexpr std::size_t kExceptions = 12;  // 0x0B is the last

  static std::size_t PlaceOf(std::uint8_t function) {
    return static_cast<std::size_t>(std::ranges::find(kFunctions, function) - kFunctions.begin());
  }

  std::array<std::array<std::atomic<std::uint64_t>, kExceptions>, kFunctions.size() + 1>
      counters_{};
};

}  // namespace baudgate::modbus
