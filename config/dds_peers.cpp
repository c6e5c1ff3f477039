// SPDX-License-Identifier: Apache-2.0
#include "config/dds_peers.h"

#include <algorithm>

#include "config/model/network.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostPeers = 64;

bool IsIpv4(const std::string& text) {
  return IsIpAddress(text) && text.find(':') == std::string::npos;
}

bool IsHere(const std::string& address) {
  const auto network = ParseNetwork(address);
  return network && IsLoopback(*network);
}

/// A datagram from 127.0.0.1 never leaves this machine.
void CheckReach(const Dds& dds, const std::string& host, const std::string& what, Mark mark,
                Problems& problems) {
  if (!IsIpv4(host) || IsHere(host) || dds.interfaces.empty()) return;
  if (!std::ranges::all_of(dds.interfaces, IsHere)) return;
  problems.Warning(mark, what + ": " + host + " is not reached from interfaces, which has only " +
                             "loopback; add this machine's address in that network");
}

void ReadPeer(const YamlNode& node, Dds& dds, Problems& problems) {
  const auto address = ReadText(node, "peers", problems);
  if (!address) return;
  if (!IsIpv4(*address) || IsEverywhere(*address)) {
    problems.Error(node.mark(), "peers: " + Quoted(*address) +
                                    " is not the IPv4 address of a machine; write for example "
                                    "10.0.0.7");
    return;
  }
  CheckReach(dds, *address, "peers", node.mark(), problems);
  dds.peers.push_back(*address);
}

}  // namespace

void ReadDdsPeers(MapReader& map, Dds& dds, Problems& problems) {
  const auto peers = map.Get("peers");
  if (!peers) return;
  for (const YamlNode& one : ReadList(*peers, "peers", kMostPeers, problems)) {
    ReadPeer(one, dds, problems);
  }
}

}  // namespace baudgate::config
