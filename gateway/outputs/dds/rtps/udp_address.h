// Where a datagram comes from or goes to.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace baudgate::dds {

struct UdpAddress {
  std::uint32_t address = 0;  ///< IPv4, host order
  std::uint16_t port = 0;

  bool operator==(const UdpAddress&) const = default;
};

/// Empty: `host` is no IPv4 address.
std::optional<UdpAddress> ParseUdpAddress(const std::string& host, std::uint16_t port);

/// "10.0.0.7".
std::string HostOf(const UdpAddress& at);
/// "10.0.0.7:7410".
std::string Text(const UdpAddress& at);

}  // namespace baudgate::dds
