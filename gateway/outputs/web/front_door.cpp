// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/front_door.h"

#include <algorithm>

#include "gateway/base/spelling.h"

namespace baudgate::web {
namespace {

/// "gate:8502" → "gate", "[::1]:8502" → "::1". Empty: that is no host.
std::string NameOf(std::string_view host) {
  std::string_view name = host.substr(0, host.find(':'));
  std::string_view port = host.substr(name.size());
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return {};
    name = host.substr(1, end - 1);
    port = host.substr(end + 1);
  }
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  if (port.starts_with(':')) port.remove_prefix(1);
  if (port.size() > 5 || !std::ranges::all_of(port, digit)) return {};
  return std::string(name);
}

/// An address cannot be rebound as a name can: the one that was connected to is good, with any
/// port, as it may be forwarded.
bool IsOurs(const config::Web& web, const Request& request, const std::string& host) {
  const std::string name = NameOf(host);
  if (name.empty()) return false;
  const auto listed = [&](const std::string& one) { return one == host || one == name; };
  if (std::ranges::any_of(web.hosts, listed)) return true;
  if (config::IsIpAddress(name)) {
    return config::Canonical(name) == config::Canonical(request.local) ||
           config::Canonical(name) == config::Canonical(web.listen.host);
  }
  return name == "localhost" && IsLoopbackPeer(request.peer);
}

/// The page itself may be opened by a link from anywhere: it has no data.
bool OpensAPage(const Request& request) {
  return request.method == "GET" && request.Header("sec-fetch-mode") == "navigate" &&
         request.Header("sec-fetch-dest") == "document" && !request.path.starts_with("/api/") &&
         request.path != "/metrics";
}

bool IsSameOrigin(const std::string& origin, const std::string& host) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme)) return config::Lower(origin.substr(scheme.size())) == host;
  }
  return false;
}

}  // namespace

bool IsLoopbackPeer(const std::string& peer) {
  return config::IsIpAddress(peer) && config::IsLoopback(config::ReachOf(peer));
}

bool IsAllowed(const config::Web& web, const std::string& peer) {
  if (web.allow.empty()) return true;
  if (!config::IsIpAddress(peer)) return false;
  const config::Network reach = config::ReachOf(peer);
  return std::ranges::any_of(
      web.allow, [&](const config::Network& network) { return config::Covers(network, reach); });
}

std::optional<Response> Refusal(const config::Web& web, const Request& request) {
  if (!IsAllowed(web, request.peer)) {
    return Problem(403, request.peer + " is not in web.allow of the gateway");
  }
  const std::string host = config::Lower(request.Header("host").value_or(""));
  if (!IsOurs(web, request, host)) {
    return Problem(421, "this gateway is not known as " + config::Quoted(host) +
                            "; add the name to web.hosts of its configuration");
  }
  const auto origin = request.Header("origin");
  if (origin && !IsSameOrigin(*origin, host)) {
    return Problem(403, "a page of " + config::Quoted(*origin) + " may not ask this gateway");
  }
  const auto site = request.Header("sec-fetch-site");
  if (site && *site != "same-origin" && *site != "none" && !OpensAPage(request)) {
    return Problem(403, "another page may not ask this gateway");
  }
  return std::nullopt;
}

bool CameByTls(const config::Web& web, const Request& request) {
  const bool proxy =
      IsLoopbackPeer(request.peer) || (!web.allow.empty() && IsAllowed(web, request.peer));
  return proxy && config::Lower(request.Header("x-forwarded-proto").value_or("")) == "https";
}

bool MayAcknowledge(const config::Web& web, const Request& request) {
  if (!web.acknowledge) return false;
  const bool forwarded = request.Header("x-forwarded-proto") || request.Header("x-forwarded-for") ||
                         request.Header("forwarded");
  return CameByTls(web, request) || (IsLoopbackPeer(request.peer) && !forwarded);
}

}  // namespace baudgate::web
