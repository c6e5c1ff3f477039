// SPDX-License-Identifier: Apache-2.0
#include "config/model/discovery_server.h"

#include <string>

#include "gateway/base/spelling.h"

namespace baudgate::config {

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
