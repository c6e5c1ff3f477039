// How many datagrams the DDS library was given and how many it was spared: counted by
// gateway/outputs/dds/fast/datagram_gate.h, carried by the link, shown by the status.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <numeric>

#include "gateway/outputs/dds/refusal.h"

namespace baudgate::dds {

struct DatagramCounters {
  std::uint64_t passed = 0;
  std::array<std::uint64_t, kRefusals> refused{};  ///< by Refusal
  std::uint32_t participants = 0;                  ///< that have a place now

  bool operator==(const DatagramCounters&) const = default;
  std::uint64_t Refused(Refusal reason) const { return refused[static_cast<std::size_t>(reason)]; }
  std::uint64_t AllRefused() const {
    return std::accumulate(refused.begin(), refused.end(), std::uint64_t{0});
  }
  /// What another process has counted before; its participants are gone.
  void AddEarlier(const DatagramCounters& earlier) {
    passed += earlier.passed;
    for (std::size_t i = 0; i < kRefusals; ++i) refused[i] += earlier.refused[i];
  }
};

}  // namespace baudgate::dds
