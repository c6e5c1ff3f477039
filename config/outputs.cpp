// SPDX-License-Identifier: Apache-2.0
#include "config/outputs.h"

#include "config/names.h"
#include "config/network.h"
#include "config/serial.h"
#include "config/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostListeners = 64;
constexpr std::size_t kMostNetworks = 1000;
constexpr std::size_t kMostInterfaces = 64;
constexpr int kMostClients = 10'000;
constexpr std::size_t kLongestSocketPath = 107;  // what sockaddr_un takes, without the last zero
constexpr int kLastDomain = 232;                 // beyond, DDS would compute ports above 65535

constexpr std::array<Word<Permit>, 2> kWrite = {{{"allow", Permit::all}, {"deny", Permit::read}}};
constexpr std::array<Word<Priority>, 3> kPriorities = {
    {{"low", Priority::low}, {"normal", Priority::normal}, {"high", Priority::high}}};

void ReadAt(const YamlNode& node, const std::string& what, Listener& listener, Problems& problems) {
  const auto text = ReadText(node, what, problems);
  if (!text) return;
  const auto at = ParseHostPort(*text);
  if (!at) {
    problems.Error(node.mark(), what + ": " + at.error());
    return;
  }
  if (!IsIpAddress(at->host) && at->host != "localhost") {
    problems.Error(node.mark(), what + ": " + Quoted(at->host) +
                                    " is not an address of this machine; write an IP address, "
                                    "0.0.0.0 for all");
    return;
  }
  listener.host = at->host == "localhost" ? "127.0.0.1" : at->host;
  listener.port = at->port;
}

std::vector<Network> ReadAllow(const YamlNode& node, Problems& problems) {
  std::vector<YamlNode> ranges = {node};
  if (node.kind() != YamlNode::Kind::scalar) {
    ranges = ReadList(node, "allow", kMostNetworks, problems);
    if (node.kind() == YamlNode::Kind::list && ranges.empty()) {
      problems.Error(node.mark(),
                     "allow: an empty list would let nobody in; leave the key out to "
                     "allow everybody");
    }
  }
  std::vector<Network> networks;
  for (const YamlNode& range : ranges) {
    const auto text = ReadText(range, "allow", problems);
    if (!text) continue;
    auto network = ParseNetwork(*text);
    if (network) {
      networks.push_back(std::move(*network));
    } else {
      problems.Error(range.mark(), "allow: " + network.error());
    }
  }
  return networks;
}

Listener ReadListener(const YamlNode& node, Problems& problems) {
  Listener listener;
  listener.mark = node.mark();
  if (node.kind() == YamlNode::Kind::scalar) {
    ReadAt(node, "listen", listener, problems);
    return listener;
  }
  MapReader map(node, "listen", problems);
  if (const auto at = map.Get("at")) ReadAt(*at, "at", listener, problems);
  if (const auto allow = map.Get("allow")) listener.allow = ReadAllow(*allow, problems);
  Assign(listener.permit, map.OneOf("write", kWrite));
  Assign(listener.priority, map.OneOf("priority", kPriorities));
  Assign(listener.max_clients, map.Integer("max_clients", 1, kMostClients));
  Assign(listener.idle_timeout, map.Time("idle_timeout", 1s, 24h));
  map.Finish();
  return listener;
}

// The daemon has no working directory of its own choosing. Empty when the key is absent or wrong.
std::string ReadAbsolutePath(MapReader& map, const std::string& key, const std::string& example) {
  const auto path = map.Label(key);
  if (!path) return {};
  if (path->starts_with('/')) return *path;
  map.problems().Error(
      map.MarkOf(key),
      key + ": " + Quoted(*path) + " is not an absolute path; write for example " + example);
  return {};
}

}  // namespace

Pace ReadGateway(const YamlNode& node, Config& config, Problems& problems) {
  MapReader map(node, "gateway", problems);
  Assign(config.name, map.Text("name"));
  if (const Status status = CheckName(config.name); !status) {
    problems.Error(map.MarkOf("name"), "name: " + status.error());
  }
  config.recordings = ReadAbsolutePath(map, "recordings", "/var/lib/baudgate/recordings");
  config.socket = ReadAbsolutePath(map, "socket", "/run/baudgate/gate.sock");
  if (config.socket.size() > kLongestSocketPath) {
    problems.Error(map.MarkOf("socket"), "socket: the path is too long; at most " +
                                             std::to_string(kLongestSocketPath) + " bytes");
  }
  const Pace pace = ReadPace(map);
  map.Finish();
  return pace;
}

Modbus DefaultModbus() {
  Modbus modbus;
  modbus.listen.emplace_back();
  return modbus;
}

Modbus ReadModbus(const YamlNode& node, Uniques& uniques, Problems& problems) {
  Modbus modbus;
  MapReader map(node, "modbus", problems);
  Assign(modbus.enabled, map.Flag("enabled"));
  map.Refuse("routes",
             "transparent routes are not supported by this version; remove 'routes' and "
             "give the devices behind it points of their own");
  const auto listen = map.Get("listen");
  map.Finish();
  if (!listen) {
    modbus.listen = DefaultModbus().listen;
    return modbus;
  }
  std::vector<YamlNode> places = {*listen};
  if (listen->kind() == YamlNode::Kind::list) {
    places = ReadList(*listen, "listen", kMostListeners, problems);
    if (places.empty()) {
      problems.Error(listen->mark(),
                     "listen: the list is empty; to serve nothing on Modbus write "
                     "modbus: { enabled: false }");
    }
  }
  for (const YamlNode& place : places) {
    modbus.listen.push_back(ReadListener(place, problems));
    CheckListener(modbus.listen.back(), problems);
    uniques.Listener(modbus.listen.back().Place(), place.mark());
  }
  return modbus;
}

Dds ReadDds(const YamlNode& node, Problems& problems) {
  Dds dds;
  MapReader map(node, "dds", problems);
  Assign(dds.enabled, map.Flag("enabled"));
  Assign(dds.domain, map.Integer("domain", 0, kLastDomain));
  Assign(dds.shared_memory, map.Flag("shared_memory"));
  Assign(dds.heartbeat, map.Time("heartbeat", 100ms, 1h));
  if (const auto interfaces = map.Get("interfaces")) {
    dds.interfaces.clear();
    for (const YamlNode& one : ReadList(*interfaces, "interfaces", kMostInterfaces, problems)) {
      const auto address = ReadText(one, "interfaces", problems);
      if (!address) continue;
      if (!IsIpAddress(*address)) {
        problems.Error(one.mark(), "interfaces: " + Quoted(*address) +
                                       " is not an IP address; write for example 127.0.0.1");
      }
      dds.interfaces.push_back(*address);
    }
    if (dds.enabled && !dds.shared_memory && dds.interfaces.empty()) {
      problems.Error(interfaces->mark(),
                     "interfaces: the list is empty and shared_memory is off: "
                     "nobody could be reached; write [127.0.0.1]");
    }
  }
  map.Finish();
  return dds;
}

}  // namespace baudgate::config
