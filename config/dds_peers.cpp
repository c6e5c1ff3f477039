// SPDX-License-Identifier: Apache-2.0
#include "config/dds_peers.h"

#include <algorithm>

#include "config/model/network.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

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
  if (!IsMachineIpv4(*address)) {
    problems.Error(node.mark(), "peers: " + Quoted(*address) +
                                    " is not the IPv4 address of a machine; write for example "
                                    "10.0.0.7");
    return;
  }
  if (std::ranges::find(dds.peers, *address) != dds.peers.end()) {
    problems.Warning(node.mark(), "peers: " + *address + " stands there already");
  }
  CheckReach(dds, *address, "peers", node.mark(), problems);
  dds.peers.push_back(*address);
}

void ReadServer(const YamlNode& node, Dds& dds, Problems& problems) {
  const auto text = ReadText(node, "discovery_servers", problems);
  if (!text) return;
  const auto server = ParseDiscoveryServer(*text);
  if (!server || IsEverywhere(server->host)) {
    problems.Error(node.mark(), "discovery_servers: " +
                                    (server ? Quoted(*text) + " is not the address of one machine"
                                            : server.error()));
    return;
  }
  if (std::ranges::find(dds.discovery_servers, *server) != dds.discovery_servers.end()) {
    problems.Warning(node.mark(), "discovery_servers: " + *text + " stands there already");
  }
  CheckReach(dds, server->host, "discovery_servers", node.mark(), problems);
  dds.discovery_servers.push_back(*server);
}

}  // namespace

void ReadDdsPeers(MapReader& map, Dds& dds, Problems& problems) {
  if (const auto peers = map.Get("peers")) {
    for (const YamlNode& one : ReadList(*peers, "peers", kMostPeers, problems)) {
      ReadPeer(one, dds, problems);
    }
  }
  if (const auto servers = map.Get("discovery_servers")) {
    for (const YamlNode& one :
         ReadList(*servers, "discovery_servers", kMostDiscoveryServers, problems)) {
      ReadServer(one, dds, problems);
    }
  }
  if (const auto multicast = map.Flag("multicast")) {
    dds.multicast = *multicast;
    if (!*multicast && dds.peers.empty() && dds.discovery_servers.empty()) {
      problems.Warning(map.MarkOf("multicast"),
                       "multicast: off, and there are neither peers nor discovery_servers: only "
                       "participants that ask this gateway find it");
    }
  }
}

}  // namespace baudgate::config
