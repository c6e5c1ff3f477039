// Where a DDS discovery server listens, as users write it: in `dds.discovery_servers` and on the
// command line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/model/network.h"

namespace baudgate::config {

inline constexpr std::size_t kMostDiscoveryServers = 16;
inline constexpr std::uint16_t kDiscoveryPort = 11811;

/// "10.0.0.7:11811", or "localhost:11811", which is 127.0.0.1. Other names are an error: a lookup
/// that takes its time would hold DDS up.
Result<HostPort> ParseDiscoveryServer(std::string_view text);

}  // namespace baudgate::config
