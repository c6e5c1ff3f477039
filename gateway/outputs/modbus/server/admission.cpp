// Compares a peer with the networks of a listener.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/admission.h"

#include <algorithm>

namespace baudgate::modbus {
namespace {

constexpr std::size_t kIpv4At = 12;
constexpr int kIpv4Prefix = 96;

bool SamePrefix(const PeerAddress& a, const PeerAddress& b, int from, int to) {
  for (int bit = from; bit < to; ++bit) {
    const auto byte = static_cast<std::size_t>(bit / 8);
    if ((((a[byte] ^ b[byte]) >> (7 - bit % 8)) & 1) != 0) return false;
  }
  return true;
}

bool IsMapped(const PeerAddress& peer) {
  constexpr std::array<std::uint8_t, kIpv4At> kMapped = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};
  return std::equal(kMapped.begin(), kMapped.end(), peer.begin());
}

/// Written with dots only: the four bytes decide, whatever stands before them.
bool IsIpv4(const config::Network& network) {
  return network.prefix >= kIpv4Prefix && network.text.find(':') == std::string::npos;
}

}  // namespace

bool Contains(const config::Network& network, const PeerAddress& peer) {
  const int prefix = std::clamp(network.prefix, 0, 128);
  if (!IsIpv4(network)) return SamePrefix(peer, network.bytes, 0, prefix);
  return IsMapped(peer) && SamePrefix(peer, network.bytes, kIpv4Prefix, prefix);
}

bool Allows(std::span<const config::Network> list, const PeerAddress& peer) {
  if (list.empty()) return true;
  return std::ranges::any_of(
      list, [&](const config::Network& network) { return Contains(network, peer); });
}

config::Priority PriorityOf(const config::Listener& listener, const PeerAddress& peer) {
  for (const config::ClientPriority& rule : listener.clients) {
    if (Contains(rule.from, peer)) return rule.priority;
  }
  return listener.priority;
}

}  // namespace baudgate::modbus
