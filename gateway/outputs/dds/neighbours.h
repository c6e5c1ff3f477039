// What baudgate-dds tells the gateway about other participants of the domain, with its counts.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/model/network.h"

namespace baudgate::dds {

/// Readers of each topic that are connected now.
struct Subscribers {
  std::uint32_t points = 0;
  std::uint32_t devices = 0;
  std::uint32_t events = 0;
  std::uint32_t alarms = 0;

  bool operator==(const Subscribers&) const = default;
};

struct Neighbours {
  static constexpr std::size_t kMostReached = 64;
  static constexpr std::size_t kMostRemarks = 8;

  /// IPv4 addresses and ports of subscribers. The next process announces itself there at once:
  /// without multicast a subscriber would find it seconds later.
  std::vector<config::HostPort> reached;
  /// One sentence each: a subscriber that can get nothing, or what keeps all of them from it.
  std::vector<std::string> remarks;

  bool operator==(const Neighbours&) const = default;
};

}  // namespace baudgate::dds
