// Parses network addresses as users write them: where to listen, which clients are allowed to
// connect, the host of a serial server. ParseDiscoveryServer parses the address of a DDS discovery
// server.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "config/model/fields.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// An address range in CIDR form; a single address is a range of one. IPv4 is stored in its
/// IPv6-mapped form (::ffff:a.b.c.d), so IPv4 and IPv6 are compared in the same way.
struct Network {
  std::string text;                      ///< as written: "10.0.0.0/8"
  std::array<std::uint8_t, 16> bytes{};  ///< IPv4 in the last four
  int prefix = 128;                      ///< number of bits over all 16 bytes; 104 for an IPv4 /8
};

template <typename Visit>
void VisitFields(const Network*, Visit visit) {
  visit(Field<&Network::text>{"network"});
  visit(Derived<&Network::bytes>());
  visit(Derived<&Network::prefix>());
}

/// The files of one end of TLS connections (transports/tls_files.h): absolute paths; empty: none.
struct TlsFiles {
  std::string certificate{};  ///< certificate of this end, with its chain
  std::string key{};          ///< private key of the certificate
  /// Authorities that this end trusts, with the root. The certificate of the other end must lead to
  /// the root. Empty for a server: its clients need no certificate.
  std::string authorities{};

  auto operator<=>(const TlsFiles&) const = default;
  bool on() const { return !certificate.empty() || !authorities.empty(); }
};

struct HostPort {
  std::string host;  ///< without IPv6 brackets
  std::uint16_t port = 0;

  bool operator==(const HostPort&) const = default;
};

inline constexpr std::string_view kTcpScheme = "tcp://";
inline constexpr std::string_view kTlsScheme = "tls://";
inline bool IsTlsAddress(std::string_view text) { return text.starts_with(kTlsScheme); }
/// True for the port of a line that is a serial server: "tcp://host:port", "tls://host:port".
inline bool IsNetworkPort(std::string_view port) {
  return port.starts_with(kTcpScheme) || IsTlsAddress(port);
}

/// Parses "10.0.0.7:502", "[::1]:502", "server:4001".
Result<HostPort> ParseHostPort(std::string_view text, std::string_view example = "127.0.0.1:1502");
/// Like ParseHostPort, but without a port in `text` the result has `usual_port`: "10.0.0.9",
/// "[::1]", "::1".
Result<HostPort> ParseServer(std::string_view text, std::uint16_t usual_port);

/// Parses "10.0.0.0/8", "10.0.0.7", "fe80::/10".
Result<Network> ParseNetwork(std::string_view text);

/// Returns the shortest spelling of an IP address; returns any other text unchanged.
std::string Canonical(const std::string& address);
/// Returns the addresses at which clients can reach a listener at this IP address: all addresses
/// for "0.0.0.0" and "::".
Network ReachOf(const std::string& host);

/// True for "0.0.0.0" and "::", which stand for all addresses of this machine.
bool IsEverywhere(const std::string& host);
bool IsIpAddress(const std::string& text);
bool IsIpv4(const std::string& text);
/// True if a single machine can have the address: no multicast, no broadcast, none of 0.0.0.0/8 and
/// 240.0.0.0/4.
bool IsMachineIpv4(const std::string& text);
bool IsLoopback(const Network& network);
bool Covers(const Network& outer, const Network& inner);

inline constexpr std::size_t kMostDiscoveryServers = 16;
inline constexpr std::uint16_t kDiscoveryPort = 11811;

/// Parses "10.0.0.7:11811", or "localhost:11811", which gives 127.0.0.1. Other names are errors,
/// because a slow look-up would block DDS.
Result<HostPort> ParseDiscoveryServer(std::string_view text);

}  // namespace baudgate::config
