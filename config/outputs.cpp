// SPDX-License-Identifier: Apache-2.0
#include "config/outputs.h"

#include <array>

#include "config/alarms.h"
#include "config/checks/name_checks.h"
#include "config/dds_peers.h"
#include "config/dds_security.h"
#include "config/listeners.h"
#include "config/model/network.h"
#include "config/routes.h"
#include "config/serial.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostListeners = 64;
constexpr std::size_t kMostRoutes = 256;
constexpr std::size_t kMostInterfaces = 64;
constexpr std::size_t kLongestSocketPath = 107;  // what sockaddr_un takes, without the last zero
constexpr int kLastDomain = 232;                 // beyond, DDS would compute ports above 65535
constexpr std::array<Word<bool>, 2> kDdsWrite = {{{"deny", false}, {"allow", true}}};

}  // namespace

std::string ReadAbsolutePath(MapReader& map, const std::string& key, const std::string& example) {
  const auto path = map.Label(key);
  if (!path) return {};
  if (path->starts_with('/')) return *path;
  map.problems().Error(
      map.MarkOf(key),
      key + ": " + Quoted(*path) + " is not an absolute path; write for example " + example);
  return {};
}

Pace ReadGateway(const YamlNode& node, Config& config, Problems& problems) {
  MapReader map(node, "gateway", problems);
  Assign(config.name, map.Text("name"));
  if (const Status status = CheckName(config.name); !status) {
    problems.Error(map.MarkOf("name"), "name: " + status.error());
  }
  config.recordings = ReadAbsolutePath(map, "recordings", "/var/lib/baudgate/recordings");
  config.state = ReadAbsolutePath(map, "state", "/var/lib/baudgate");
  config.socket = ReadAbsolutePath(map, "socket", "/run/baudgate/gate.sock");
  if (config.socket.size() > kLongestSocketPath) {
    problems.Error(map.MarkOf("socket"), "socket: the path is too long; at most " +
                                             std::to_string(kLongestSocketPath) + " bytes");
  }
  constexpr std::array<Word<Audit>, 2> kAudits = {
      {{"best_effort", Audit::best_effort}, {"require", Audit::require}}};
  Assign(config.audit, map.OneOf("audit", kAudits));
  config.alarms = ReadAlarmSetting(map, config.alarms);
  const Pace pace = ReadPace(map, Level::gateway);
  map.Finish();
  return pace;
}

Modbus DefaultModbus() {
  Modbus modbus;
  modbus.listen.emplace_back();
  return modbus;
}

Modbus ReadModbus(const YamlNode& node, const std::vector<Line>& lines, LoadContext& context) {
  Modbus modbus;
  Problems& problems = context.problems;
  MapReader map(node, "modbus", problems);
  Assign(modbus.enabled, map.Flag("enabled"));
  if (const auto listen = map.Get("listen")) {
    std::vector<YamlNode> places = {*listen};
    if (listen->kind() == YamlNode::Kind::list) {
      places = ReadList(*listen, "listen", kMostListeners, problems);
      if (places.empty()) {
        problems.Error(listen->mark(),
                       "listen: the list is empty; to serve nothing on Modbus write "
                       "modbus: { enabled: false }");
      }
    }
    for (const YamlNode& place : places) modbus.listen.push_back(ReadListener(place, context));
  } else {
    modbus.listen = DefaultModbus().listen;
  }
  if (const auto routes = map.Get("routes")) {
    for (const YamlNode& route : ReadList(*routes, "routes", kMostRoutes, problems)) {
      modbus.routes.push_back(ReadRoute(route, modbus.listen, lines, context));
    }
    if (!modbus.enabled) {
      problems.Warning(routes->mark(),
                       "routes: Modbus is switched off (enabled: false): no request reaches them");
    }
  }
  map.Finish();
  return modbus;
}

namespace {

/// Linux gives ports of this range to programs that name none (its default; the run-time check of
/// gateway/outputs/dds/fast/own_sockets.cpp asks the system).
void CheckPorts(const Dds& dds, MapReader& map) {
  constexpr int kFirst = 32768;
  constexpr int kLast = 60999;
  const int port = 7400 + 250 * dds.domain;
  const auto domain = map.Get("domain");
  if (!domain || !dds.enabled || !dds.multicast || port < kFirst || port > kLast) return;
  map.problems().Warning(
      domain->mark(),
      "domain: its UDP port " + std::to_string(port) +
          " is one of those that Linux gives to any program (32768 to 60999); while another one "
          "has it, no new subscriber is heard; choose a domain up to 101, or reserve the port: "
          "sysctl -w net.ipv4.ip_local_reserved_ports=" +
          std::to_string(port));
}

}  // namespace

Dds ReadDds(const YamlNode& node, LoadContext& context) {
  Dds dds;
  Problems& problems = context.problems;
  MapReader map(node, "dds", problems);
  Assign(dds.enabled, map.Flag("enabled"));
  Assign(dds.domain, map.Integer("domain", 0, kLastDomain));
  Assign(dds.write, map.OneOf("write", kDdsWrite));
  Assign(dds.heartbeat, map.Time("heartbeat", 100ms, 1h));
  Assign(dds.lease, map.Time("lease", kShortestLease, kLongestLease));
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
    if (dds.enabled && dds.interfaces.empty()) {
      problems.Error(interfaces->mark(),
                     "interfaces: the list is empty: nobody could be reached; write [127.0.0.1]");
    }
  }
  if (const auto security = map.Get("security")) {
    dds.security = ReadDdsSecurity(*security, context);
  }
  ReadDdsPeers(map, dds, problems);
  CheckPorts(dds, map);
  map.Finish();
  return dds;
}

}  // namespace baudgate::config
