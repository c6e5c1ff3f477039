// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/rtps/udp_address.h"

#include <arpa/inet.h>

namespace baudgate::dds {

std::optional<UdpAddress> ParseUdpAddress(const std::string& host, std::uint16_t port) {
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) != 1) return std::nullopt;
  return UdpAddress{ntohl(address.s_addr), port};
}

std::string HostOf(const UdpAddress& at) {
  std::string text;
  for (int shift = 24; shift >= 0; shift -= 8) {
    text += std::to_string((at.address >> shift) & 0xFF);
    if (shift > 0) text += '.';
  }
  return text;
}

std::string Text(const UdpAddress& at) { return HostOf(at) + ":" + std::to_string(at.port); }

}  // namespace baudgate::dds
