// SPDX-License-Identifier: Apache-2.0
#include "config/model/network.h"

#include <arpa/inet.h>

#include <algorithm>
#include <optional>
#include <string>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

using Address = std::array<std::uint8_t, 16>;

constexpr int kMappedBits = 96;  // IPv4 addresses are stored in ::ffff:0:0/96

struct ParsedAddress {
  Address bytes{};
  bool is_v4 = false;
};

std::optional<ParsedAddress> ParseAddress(const std::string& text) {
  ParsedAddress parsed;
  if (inet_pton(AF_INET, text.c_str(), parsed.bytes.data() + 12) == 1) {
    parsed.bytes[10] = parsed.bytes[11] = 0xFF;
    parsed.is_v4 = true;
    return parsed;
  }
  if (inet_pton(AF_INET6, text.c_str(), parsed.bytes.data()) == 1) return parsed;
  return std::nullopt;
}

Address Masked(Address bytes, int prefix) {
  for (int bit = prefix; bit < 128; ++bit) {
    auto& byte = bytes[static_cast<std::size_t>(bit / 8)];
    byte = static_cast<std::uint8_t>(byte & ~(0x80U >> (bit % 8)));
  }
  return bytes;
}

std::string Shown(const Address& bytes, bool is_v4) {
  char text[INET6_ADDRSTRLEN] = {};
  if (is_v4) {
    inet_ntop(AF_INET, bytes.data() + 12, text, sizeof text);
  } else {
    inet_ntop(AF_INET6, bytes.data(), text, sizeof text);
  }
  return text;
}

}  // namespace

Result<HostPort> ParseHostPort(std::string_view text, std::string_view example) {
  const Error error{Quoted(text) + " is not host:port; write for example " + std::string(example)};
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos) return error;
  if (const std::string why = WhyLeadingZero(text.substr(colon + 1)); !why.empty()) {
    return Error{Quoted(text) + ": its port " + why};
  }
  const auto port = ParseInteger<std::uint16_t>(text.substr(colon + 1));
  std::string host(text.substr(0, colon));
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
    if (!IsIpAddress(host)) return error;
  } else if (host.empty() || host.find_first_of(":[]/ @") != std::string::npos) {
    return error;
  }
  // getaddrinfo would read 010.0.0.5 as 8.0.0.5, so such an address is an error.
  if (host.find_first_not_of("0123456789.") == std::string::npos && !IsIpAddress(host)) {
    return Error{Quoted(text) + ": " + Quoted(host) +
                 " is not an IPv4 address; write four numbers 0…255 without leading zeros"};
  }
  if (!port || *port == 0) {
    return Error{Quoted(text) + " has no usable port number; allowed: 1…65535"};
  }
  return HostPort{std::move(host), *port};
}

Result<HostPort> ParseServer(std::string_view text, std::uint16_t usual_port) {
  if (IsIpAddress(std::string(text))) return HostPort{std::string(text), usual_port};
  if (text.find(':') != std::string_view::npos && !text.ends_with(']')) return ParseHostPort(text);
  auto at = ParseHostPort(std::string(text) + ":" + std::to_string(usual_port));
  if (at) return at;
  return Error{Quoted(text) + " is not a server; write for example 10.0.0.9:502"};
}

Result<Network> ParseNetwork(std::string_view text) {
  const auto slash = text.find('/');
  const auto address = ParseAddress(std::string(text.substr(0, slash)));
  if (!address) {
    return Error{Quoted(text) + " is not an address range; write for example 10.0.0.0/8"};
  }
  const int most = address->is_v4 ? 32 : 128;
  int prefix = most;
  if (slash != std::string_view::npos) {
    if (const std::string why = WhyLeadingZero(text.substr(slash + 1)); !why.empty()) {
      return Error{Quoted(text) + ": its prefix " + why};
    }
    const auto given = ParseInteger<int>(text.substr(slash + 1));
    if (!given || *given < 0 || *given > most) {
      return Error{Quoted(text) + " has no usable prefix; allowed: /0…/" + std::to_string(most)};
    }
    prefix = *given;
  }
  Network network;
  network.text = std::string(text);
  network.prefix = address->is_v4 ? prefix + kMappedBits : prefix;
  network.bytes = Masked(address->bytes, network.prefix);
  if (network.bytes != address->bytes) {
    return Error{Quoted(text) + " has bits beyond its prefix; write " +
                 Shown(network.bytes, address->is_v4) + "/" + std::to_string(prefix)};
  }
  return network;
}

std::string Canonical(const std::string& address) {
  const auto parsed = ParseAddress(address);
  return parsed ? Shown(parsed->bytes, parsed->is_v4) : address;
}

Network ReachOf(const std::string& host) {
  const std::string address = Canonical(host);
  return ParseNetwork(IsEverywhere(address) ? address + "/0" : address).value();
}

bool IsEverywhere(const std::string& host) { return host == "0.0.0.0" || host == "::"; }

bool IsIpAddress(const std::string& text) { return ParseAddress(text).has_value(); }

bool IsIpv4(const std::string& text) {
  return IsIpAddress(text) && text.find(':') == std::string::npos;
}

bool IsMachineIpv4(const std::string& text) {
  if (!IsIpv4(text)) return false;
  const std::uint8_t first = ParseAddress(text)->bytes[12];
  return first != 0 && first < 224;
}

bool IsLoopback(const Network& network) {
  const bool is_v4 = network.bytes[10] == 0xFF && network.bytes[11] == 0xFF && network.prefix >= 96;
  if (is_v4) return network.bytes[12] == 127 && network.prefix >= kMappedBits + 8;
  Address one{};
  one[15] = 1;
  return network.bytes == one && network.prefix == 128;
}

bool Covers(const Network& outer, const Network& inner) {
  return outer.prefix <= inner.prefix && Masked(inner.bytes, outer.prefix) == outer.bytes;
}

Result<HostPort> ParseDiscoveryServer(std::string_view text) {
  const std::string port = ":" + std::to_string(kDiscoveryPort);
  if (text.empty() || text.front() == ':') {
    return Error{Quoted(text) + " has no address; write for example 10.0.0.7" + port};
  }
  if (text.find(':') == std::string_view::npos) {
    return Error{Quoted(text) + " has no port; write for example " + std::string(text) + port};
  }
  auto at = ParseHostPort(text);
  if (!at) return Error{at.error()};
  if (at->host == "localhost") at->host = "127.0.0.1";
  if (IsMachineIpv4(at->host) || IsEverywhere(at->host)) return at;
  return Error{Quoted(text) + " is not the IPv4 address and port of a server; write for example " +
               "10.0.0.7" + port + (IsIpAddress(at->host) ? "" : " (names are not looked up)")};
}

}  // namespace baudgate::config
