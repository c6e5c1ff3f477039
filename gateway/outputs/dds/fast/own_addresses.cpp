// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/own_addresses.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <array>
#include <memory>

namespace baudgate::dds {

OwnAddresses FindOwnAddresses() {
  OwnAddresses own;
  ifaddrs* raw = nullptr;
  if (getifaddrs(&raw) != 0) return own;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> list(raw, &freeifaddrs);
  for (const ifaddrs* at = raw; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET) continue;
    const auto* address = reinterpret_cast<const sockaddr_in*>(at->ifa_addr);
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size());
    auto& index = own[text.data()];
    if ((at->ifa_flags & IFF_RUNNING) != 0) index = if_nametoindex(at->ifa_name);
  }
  return own;
}

bool IsOwn(const OwnAddresses& own, const std::string& address) {
  in_addr wanted{};
  if (inet_pton(AF_INET, address.c_str(), &wanted) != 1) return false;
  return ntohl(wanted.s_addr) >> 24U == 127 || own.contains(address);
}

std::optional<std::string> WhyUnused(const OwnAddresses& own, const std::string& address) {
  if (!IsOwn(own, address)) return "no interface of this machine has it now";
  const auto at = own.find(address);
  if (at == own.end() || at->second) return std::nullopt;
  return "its interface is down or unplugged";
}

}  // namespace baudgate::dds
