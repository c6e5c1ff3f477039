// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/fair_places.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <functional>

namespace baudgate {

namespace {

constexpr std::size_t kNetworkBytes = 8;  // of an IPv6 address: the /64 network

}  // namespace

std::string AddressIn(std::string_view client) {
  client = client.substr(0, client.find(' '));  // without what a certificate names
  if (client.starts_with('[')) return std::string(client.substr(1, client.find(']') - 1));
  const std::size_t colon = client.find(':');
  const bool has_port = colon != std::string_view::npos && client.rfind(':') == colon;
  return std::string(has_port ? client.substr(0, colon) : client);
}

std::string HostOf(std::string_view client) {
  const std::string found = AddressIn(client);
  const std::string address = found.substr(0, found.find('%'));  // without the interface
  std::array<std::uint8_t, 16> bytes{};
  if (::inet_pton(AF_INET, address.c_str(), bytes.data()) == 1) return address;
  if (::inet_pton(AF_INET6, address.c_str(), bytes.data()) != 1) return std::string(client);
  std::array<char, INET6_ADDRSTRLEN> text{};
  const auto* const parts = reinterpret_cast<const in6_addr*>(bytes.data());
  if (IN6_IS_ADDR_V4MAPPED(parts)) {
    return ::inet_ntop(AF_INET, bytes.data() + 12, text.data(), text.size());
  }
  // All hosts of a link share the network fe80::/64.
  if (IN6_IS_ADDR_LINKLOCAL(parts)) return found;
  std::fill(bytes.begin() + kNetworkBytes, bytes.end(), std::uint8_t{0});
  return std::string(::inet_ntop(AF_INET6, bytes.data(), text.data(), text.size())) + "/64";
}

std::uint64_t HostNumberOf(std::string_view client) {
  return std::hash<std::string>{}(HostOf(client));
}

}  // namespace baudgate
