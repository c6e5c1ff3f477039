// The text comes from `port:` of a line and ends in a connection attempt.
// SPDX-License-Identifier: Apache-2.0
#include "transports/tcp_address.h"

#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr std::string_view kScheme = "tcp://";

}  // namespace

bool IsTcpPort(std::string_view port) { return port.starts_with(kScheme); }

Result<TcpAddress> ParseTcpPort(std::string_view port) {
  const auto wrong = [port](const char* why) {
    return Error{"\"" + std::string(port) + "\" is no serial server address: " + why +
                 "; write tcp://host:port or tcp://[::1]:port"};
  };
  if (!IsTcpPort(port)) return wrong("it does not start with tcp://");
  std::string_view rest = port.substr(kScheme.size());
  std::string_view host;
  if (rest.starts_with('[')) {
    const auto end = rest.find(']');
    if (end == std::string_view::npos) return wrong("the bracket is not closed");
    host = rest.substr(1, end - 1);
    rest.remove_prefix(end + 1);
    if (host.find(':') == std::string_view::npos) return wrong("brackets are for IPv6 addresses");
  } else {
    const auto colon = rest.find(':');
    host = rest.substr(0, colon);
    rest.remove_prefix(host.size());
    if (rest.find(':', 1) != std::string_view::npos) {
      return wrong("an IPv6 address stands in brackets");
    }
  }
  if (host.empty()) return wrong("the host is missing");
  if (host.find_first_of("/@?# \t[]") != std::string_view::npos) {
    return wrong("the host has a character that no name has");
  }
  if (!rest.starts_with(':')) return wrong("the port number is missing");
  const auto number = ParseInteger<std::uint16_t>(rest.substr(1));
  if (!number || *number == 0) return wrong("the port number is not 1…65535");
  return TcpAddress{std::string(host), *number};
}

}  // namespace baudgate
