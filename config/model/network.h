// Addresses of the network side, as users write them: where to listen, which clients may come,
// which host a serial server has. Text comes from config/outputs and config/lines.
// ParseDiscoveryServer reads where a DDS discovery server listens.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "config/model/fields.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// An address range in CIDR form; a single address is its own range. IPv4 is held in its
/// IPv6-mapped form (::ffff:a.b.c.d), so that one comparison serves both.
struct Network {
  std::string text;                      ///< as written: "10.0.0.0/8"
  std::array<std::uint8_t, 16> bytes{};  ///< IPv4 in the last four
  int prefix = 128;                      ///< over all 16 bytes; IPv4 /8 is 104
};

template <typename Visit>
void VisitFields(const Network*, Visit visit) {
  visit(Field<&Network::text>{"network"});
  visit(Derived<&Network::bytes>());
  visit(Derived<&Network::prefix>());
}

struct HostPort {
  std::string host;  ///< without the brackets of IPv6
  std::uint16_t port = 0;

  bool operator==(const HostPort&) const = default;
};

/// "10.0.0.7:502", "[::1]:502", "server:4001".
Result<HostPort> ParseHostPort(std::string_view text, std::string_view example = "127.0.0.1:1502");
/// The same, but the port may be left out: "10.0.0.9", "[::1]", "::1".
Result<HostPort> ParseServer(std::string_view text, std::uint16_t usual_port);

/// "10.0.0.0/8", "10.0.0.7", "fe80::/10".
Result<Network> ParseNetwork(std::string_view text);

/// The shortest spelling of an IP address; any other text as it is.
std::string Canonical(const std::string& address);
/// What comes in at a listener of this IP address: all of it for "0.0.0.0" and "::".
Network ReachOf(const std::string& host);

/// "0.0.0.0" and "::": all addresses of this machine.
bool IsEverywhere(const std::string& host);
bool IsIpAddress(const std::string& text);
bool IsIpv4(const std::string& text);
/// One machine can have it: no multicast, no broadcast, none of 0.0.0.0/8 and 240.0.0.0/4.
bool IsMachineIpv4(const std::string& text);
/// Whether every address of it is this machine's own.
bool IsLoopback(const Network& network);
/// Whether every address of `inner` is one of `outer`.
bool Covers(const Network& outer, const Network& inner);

// Where a DDS discovery server listens, as users write it: in `dds.discovery_servers` and on the
// command line.

inline constexpr std::size_t kMostDiscoveryServers = 16;
inline constexpr std::uint16_t kDiscoveryPort = 11811;

/// "10.0.0.7:11811", or "localhost:11811", which is 127.0.0.1. Other names are an error: a lookup
/// that takes its time would hold DDS up.
Result<HostPort> ParseDiscoveryServer(std::string_view text);

}  // namespace baudgate::config
