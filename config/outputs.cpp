// SPDX-License-Identifier: Apache-2.0
#include "config/outputs.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "config/checks/uniques.h"
#include "config/events.h"
#include "config/files.h"
#include "config/lines.h"
#include "config/modbus.h"
#include "config/model/network.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

bool IsHere(const std::string& address) {
  const auto network = ParseNetwork(address);
  return network && IsLoopback(*network);
}

/// Warns of a host on another machine if all interfaces are loopback, because a datagram from
/// 127.0.0.1 never leaves this machine.
void CheckReach(const Dds& dds, const std::string& host, const std::string& what, Mark mark,
                Problems& problems) {
  if (!IsIpv4(host) || IsHere(host) || dds.interfaces.empty()) return;
  if (!std::ranges::all_of(dds.interfaces, IsHere)) return;
  problems.Warning(mark,
                   what + ": " + host +
                       " cannot be reached, because interfaces has only loopback; add the address "
                       "that this machine has in the network of this host to interfaces");
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
    problems.Warning(node.mark(),
                     "peers: " + *address + " is already in the list; remove one of the two");
  }
  CheckReach(dds, *address, "peers", node.mark(), problems);
  dds.peers.push_back(*address);
}

void ReadServer(const YamlNode& node, Dds& dds, Problems& problems) {
  const auto parse = [](const std::string& text) -> Result<HostPort> {
    auto server = ParseDiscoveryServer(text);
    if (!server || !IsEverywhere(server->host)) return server;
    return Error{Quoted(text) + " is not the address of one machine; write for example 10.0.0.7"};
  };
  const auto server = ReadParsed(node, "discovery_servers", problems, parse);
  if (!server) return;
  if (std::ranges::find(dds.discovery_servers, *server) != dds.discovery_servers.end()) {
    problems.Warning(node.mark(), "discovery_servers: " + node.text() +
                                      " is already in the list; remove one of the two");
  }
  CheckReach(dds, server->host, "discovery_servers", node.mark(), problems);
  dds.discovery_servers.push_back(*server);
}

/// Reads the hosts that discovery asks in addition to the multicast group, or instead of it: `dds:
/// { peers, discovery_servers, multicast }`. Must be called after `interfaces` was read, because it
/// warns of hosts that the interfaces do not reach.
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
                       "multicast: is off, and peers and discovery_servers are empty, so the "
                       "gateway itself finds no DDS participants; add peers");
    }
  }
}

namespace fs = std::filesystem;

constexpr std::size_t kLongestPath = 255;  // limit of the DDS process

/// Returns the absolute path; a relative `path` is relative to the configuration's folder.
std::string PathOf(const std::string& path, const std::string& key, const Mark& mark,
                   LoadContext& context) {
  std::error_code error;
  const std::string full = fs::absolute(context.base / path, error).lexically_normal().string();
  if (!path.empty() && !error && full.size() <= kLongestPath) return full;
  context.problems.Error(mark, key + ": " + Quoted(path) + " is not a path of at most " +
                                   std::to_string(kLongestPath) + " bytes");
  return {};
}

/// Reads `dds: { security: … }`: a folder, or the files one by one. Returns absolute paths. The
/// files are not opened here, so a missing or wrong file does not make the configuration invalid;
/// the running gateway and `baudgate check` report it.
DdsSecurity ReadDdsSecurity(const YamlNode& node, LoadContext& context) {
  if (node.kind() == YamlNode::Kind::scalar) {
    const auto folder = ReadText(node, "security", context.problems);
    if (!folder) return {};
    DdsSecurity security = SecurityIn(PathOf(*folder, "security", node.mark(), context));
    security.keys.map = node.mark();
    return security;
  }
  MapReader map(node, "security", context.problems);
  DdsSecurity security;
  security.keys = map.keys();
  const auto read = [&](const char* key, std::string& to, bool needed) {
    if (needed && !map.Has(key)) map.Need(key, std::string("/etc/baudgate/dds/") + key + ".pem");
    if (const auto path = map.Label(key)) to = PathOf(*path, key, map.MarkOf(key), context);
  };
  read("ca", security.ca, true);
  read("permissions_ca", security.permissions_ca, false);
  read("identity", security.identity, true);
  read("key", security.key, true);
  read("password_file", security.password_file, false);
  read("governance", security.governance, true);
  read("permissions", security.permissions, true);
  map.Finish();
  return security;
}

constexpr std::size_t kMostHosts = 100;

/// True for a host name as browsers show it after "http://", with or without a port.
bool IsHost(std::string_view text) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.' || c == ':' ||
           c == '_' || c == '[' || c == ']';
  };
  return !text.empty() && text.size() <= 260 && std::ranges::all_of(text, fits);
}

void ReadHosts(const YamlNode& list, Web& web, Problems& problems) {
  for (const YamlNode& node : ReadList(list, "hosts", kMostHosts, problems)) {
    const auto text = ReadText(node, "hosts", problems);
    if (!text) continue;
    const std::string host = Lower(*text);
    if (!IsHost(host)) {
      problems.Error(
          node.mark(),
          "hosts: " + Quoted(*text) +
              " is not a host name; write for example gate.example.com, without http://");
      continue;
    }
    web.hosts.push_back(host);
  }
}

void ReadTokenFile(const YamlNode& node, Web& web, Problems& problems) {
  MapReader map(node, "token", problems);
  if (node.kind() != YamlNode::Kind::map) return;
  if (const auto credential = map.Label("credential")) {
    web.token_file = std::string(kCredentials) + *credential;
    web.token_mark = map.MarkOf("credential");
    map.Refuse("file", "file: the token is the credential '" + *credential + "' already");
  } else {
    map.Need("file", "/etc/baudgate/web.token");
    web.token_file = ReadAbsolutePath(map, "file", "/etc/baudgate/web.token");
    web.token_mark = map.MarkOf("file");
  }
  map.Finish();
}

/// Reads the key `users`:
///
///   users: { file: /etc/baudgate/users }
Users ReadUsers(const YamlNode& node, Problems& problems) {
  Users users;
  MapReader map(node, "users", problems);
  if (node.kind() != YamlNode::Kind::map) return users;
  map.Need("file", "/etc/baudgate/users");
  users.file = ReadAbsolutePath(map, "file", "/etc/baudgate/users");
  users.mark = map.MarkOf("file");
  map.Finish();
  return users;
}

/// Reads the key `web`: the page for browsers, JSON for programs, metrics for Prometheus. A server
/// that listens beyond loopback without a token is an error.
///
///   web:
///     listen: 127.0.0.1:8502
///     allow: [10.0.0.0/8]
///     hosts: [gate.example.com]
///     token: { file: /etc/baudgate/web.token }
///     acknowledge: allow
///     proxies: [10.0.0.5]
///     certificate: /etc/baudgate/web/gateway.pem
///     key: /etc/baudgate/web/gateway.key
Web ReadWeb(const YamlNode& node, bool has_users, Problems& problems) {
  Web web;
  web.on = true;
  MapReader map(node, "web", problems);
  if (const auto listen = map.Get("listen")) {
    Assign(web.listen, ReadOwnAddress(*listen, "listen", "127.0.0.1:8502", problems));
  }
  if (const auto allow = map.Get("allow")) web.allow = ReadAllow(*allow, "allow", problems);
  if (const auto proxies = map.Get("proxies")) {
    web.proxies = ReadNetworks(*proxies, "proxies", problems);
    for (const Network& network : web.proxies) {
      if (!network.text.ends_with("/0")) continue;
      problems.Warning(proxies->mark(), "proxies: " + network.text +
                                            " trusts every machine, so every client could claim "
                                            "any address; list only the addresses of proxies");
    }
  }
  if (const auto hosts = map.Get("hosts")) ReadHosts(*hosts, web, problems);
  const auto token = map.Get("token");
  if (token) ReadTokenFile(*token, web, problems);
  map.Read<&Web::acknowledge>(web);
  web.tls = ReadServerTls(map, "web");
  web.certificate_mark = map.MarkOf("certificate");
  map.Finish();
  if (!token && !has_users && !web.on_loopback()) {
    problems.Error(map.MarkOf("listen"),
                   "listen: " + web.Address() +
                       " can be reached from other machines without a login; add token: { file: "
                       "/etc/baudgate/web.token } or the section users, or listen on 127.0.0.1");
  }
  return web;
}

constexpr std::size_t kMostBrokers = 8;

/// Parses "mqtt://host", "mqtts://host:8883". The error does not repeat the text, because users of
/// other programs write their password into it.
Result<MqttBroker> ParseBroker(const std::string& text) {
  MqttBroker broker;
  broker.tls = text.starts_with(kMqttsScheme);
  if (!broker.tls && !text.starts_with(kMqttScheme)) {
    return Error{"is not the address of a broker; write for example mqtt://10.0.0.9:1883"};
  }
  const std::string place = text.substr(broker.tls ? kMqttsScheme.size() : kMqttScheme.size());
  if (place.find('@') != std::string::npos) {
    return Error{"contains a user name; write the keys user and password instead"};
  }
  auto at = ParseServer(place, broker.tls ? 8883 : 1883);
  if (!at) return Error{at.error()};
  broker.at = std::move(*at);
  return broker;
}

void ReadBrokers(const YamlNode& node, Mqtt& mqtt, Problems& problems) {
  std::vector<YamlNode> places = {node};
  if (node.kind() == YamlNode::Kind::list) {
    places = ReadList(node, "broker", kMostBrokers, problems);
    if (places.empty()) {
      problems.Error(node.mark(), "broker: the list is empty; write mqtt://10.0.0.9:1883");
    }
  }
  for (const YamlNode& one : places) {
    if (auto broker = ReadParsed(one, "broker", problems, ParseBroker)) {
      mqtt.brokers.push_back(std::move(*broker));
    }
  }
}

constexpr std::size_t kLongestTopic = 200;
constexpr std::array<std::string_view, 5> kPlaceholders = {"{prefix}", "{gateway}", "{line}",
                                                           "{device}", "{point}"};

/// Checks a topic, or the begin of topics, that contains no placeholders.
Status CheckTopic(std::string_view topic) {
  if (topic.empty() || topic.size() > kLongestTopic || topic.front() == '$' ||
      topic.front() == '/' || topic.back() == '/' || topic.find("//") != std::string_view::npos) {
    return Error{Quoted(topic) +
                 " is no topic of one or more names with '/' between them, at most 200 bytes"};
  }
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  if (topic.find_first_of("+#") != std::string_view::npos ||
      FirstNotUtf8(topic) != std::string_view::npos || std::ranges::any_of(topic, is_control)) {
    return Error{Quoted(topic) + " contains +, # or another character that topics must not have"};
  }
  return {};
}

/// Checks that the pattern gives each point a topic of its own: it contains {device} (names of
/// devices are unique in the gateway) and {point}, and names that follow each other are apart.
Status CheckPattern(const Config& config) {
  const std::string& pattern = config.mqtt.topic;
  std::string plain;   // every placeholder is replaced by "x"
  std::string shaped;  // the names of lines, devices and points are replaced by "*"
  bool after_name = false;
  for (std::size_t at = 0; at < pattern.size();) {
    const std::string_view rest = std::string_view(pattern).substr(at);
    const auto found = std::ranges::find_if(
        kPlaceholders, [&](std::string_view one) { return rest.starts_with(one); });
    if (found == kPlaceholders.end()) {
      if (rest.front() == '{' || rest.front() == '}') {
        return Error{Quoted(pattern) +
                     " contains another {} than {prefix}, {gateway}, {line}, {device}, {point}"};
      }
      plain += rest.front();
      shaped += rest.front();
      after_name = after_name && CheckName(std::string("a") + rest.front() + "b").ok();
      ++at;
      continue;
    }
    if (after_name) {
      return Error{Quoted(pattern) + " cannot tell two points apart; put a '/' between the names"};
    }
    after_name = true;
    plain += 'x';
    shaped += *found == "{prefix}"    ? config.mqtt.prefix
              : *found == "{gateway}" ? config.name
                                      : std::string("*");
    at += found->size();
  }
  for (const char* needed : {"{device}", "{point}"}) {
    if (pattern.find(needed) == std::string::npos) {
      return Error{Quoted(pattern) + " cannot tell two points apart; add " + needed};
    }
  }
  if (const Status status = CheckTopic(plain); !status) return Error{status.error()};
  for (const char* own : {"status", "events", "alarms"}) {
    const std::string topic = config.mqtt.prefix + "/" + config.name + "/" + own;
    if (MatchesPattern(shaped, topic)) {
      return Error{Quoted(pattern) + " could give a point the topic " + topic +
                   " of the gateway; write for example {prefix}/{gateway}/{device}/{point}"};
    }
  }
  return {};
}

std::string ReadPasswordFile(const YamlNode& node, Mark& mark, Problems& problems) {
  MapReader map(node, "password", problems);
  if (node.kind() != YamlNode::Kind::map) return {};
  constexpr char kExample[] = "/etc/baudgate/mqtt.password";
  map.Need("file", kExample);
  std::string file = ReadAbsolutePath(map, "file", kExample);
  mark = map.MarkOf("file");
  map.Finish();
  return file;
}

void CheckMqtt(const Config& config, MapReader& map) {
  const Mqtt& mqtt = config.mqtt;
  Problems& problems = map.problems();
  if (const Status status = CheckTopic(mqtt.prefix); !status) {
    return problems.Error(map.MarkOf("prefix"), "prefix: " + status.error());
  }
  if (const Status status = CheckPattern(config); !status) {
    problems.Error(map.MarkOf("topic"), "topic: " + status.error());
  } else if (mqtt.topic.find("{gateway}") == std::string::npos) {
    problems.Warning(map.MarkOf("topic"),
                     "topic: without {gateway} a second gateway with the same names of devices "
                     "would share these topics; add {gateway}");
  }
  const bool sparkplug = mqtt.payload == Mqtt::Payload::sparkplug;
  if (sparkplug && mqtt.prefix.find('/') != std::string::npos) {
    problems.Error(map.MarkOf("prefix"),
                   "prefix: " + Quoted(mqtt.prefix) + " contains '/', which a group must not have");
  }
  if (sparkplug && mqtt.homeassistant) {
    problems.Error(map.MarkOf("homeassistant"),
                   "homeassistant: Home Assistant does not read Sparkplug; write payload: json");
  }
  if (!sparkplug) {
    map.Refuse("primary_host", "primary_host: applies only with payload: sparkplug");
  }
}

/// Reads the key `mqtt`:
///
///   mqtt:
///     broker: mqtts://broker.example:8883
///     user: gate
///     password: { file: /etc/baudgate/mqtt.password }
///     ca: /etc/baudgate/mqtt/ca.pem
///     prefix: plant/north
///     commands: allow
Mqtt ReadMqtt(const YamlNode& node, Config config, Problems& problems) {
  Mqtt& mqtt = config.mqtt;
  mqtt.on = true;
  mqtt.mark = node.mark();
  MapReader map(node, "mqtt", problems);
  if (node.kind() != YamlNode::Kind::map) return mqtt;
  if (const auto broker = map.Need("broker", "mqtt://10.0.0.9:1883")) {
    ReadBrokers(*broker, mqtt, problems);
  }
  if (const auto user = map.Label("user")) mqtt.user = *user;
  if (const auto password = map.Get("password")) {
    mqtt.password_file = ReadPasswordFile(*password, mqtt.password_mark, problems);
    if (mqtt.user.empty()) {
      problems.Error(map.MarkOf("password"), "password: has no effect without user; add user");
    }
  }
  const bool tls = std::ranges::any_of(mqtt.brokers, &MqttBroker::tls);
  mqtt.tls = ReadClientTls(map, tls, "mqtt", kMqttsScheme);
  if (const auto client = map.Label("client")) mqtt.client = *client;
  if (const auto prefix = map.Label("prefix")) mqtt.prefix = *prefix;
  if (const auto topic = map.Label("topic")) mqtt.topic = *topic;
  map.Read<&Mqtt::payload, &Mqtt::values, &Mqtt::homeassistant, &Mqtt::commands>(mqtt);
  if (mqtt.payload == Mqtt::Payload::sparkplug) map.Read<&Mqtt::primary_host>(mqtt);
  if (mqtt.client.empty()) mqtt.client = "baudgate-" + config.name;
  CheckMqtt(config, map);
  map.Finish();
  return mqtt;
}

constexpr std::size_t kMostListeners = 64;
constexpr std::size_t kMostRoutes = 256;
constexpr std::size_t kMostInterfaces = 64;
constexpr std::size_t kLongestSocketPath = 107;  // the size of sockaddr_un without the final zero

}  // namespace

Pace ReadGateway(const YamlNode& node, Config& config, Problems& problems) {
  MapReader map(node, "gateway", problems);
  map.Read<&Config::name>(config);
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
  map.Read<&Config::audit>(config);
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
  map.Read<&Modbus::enabled>(modbus);
  if (const auto listen = map.Get("listen")) {
    std::vector<YamlNode> places = {*listen};
    if (listen->kind() == YamlNode::Kind::list) {
      places = ReadList(*listen, "listen", kMostListeners, problems);
      if (places.empty()) {
        problems.Error(
            listen->mark(),
            "listen: the list is empty; to switch Modbus off write modbus: { enabled: false }");
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
                       "routes: have no effect, because Modbus is switched off; remove routes, or "
                       "enabled: false");
    }
  }
  map.Finish();
  return modbus;
}

namespace {

/// Warns if the domain's UDP port is in the range from which Linux assigns ports to programs (its
/// default range; at run time gateway/outputs/dds/fast/own_network.cpp asks the system).
void CheckPorts(const Dds& dds, MapReader& map) {
  constexpr int kFirst = 32768;
  constexpr int kLast = 60999;
  const int port = 7400 + 250 * dds.domain;
  const auto domain = map.Get("domain");
  if (!domain || !dds.enabled || !dds.multicast || port < kFirst || port > kLast) return;
  map.problems().Warning(
      domain->mark(), "domain: other programs can take its UDP port " + std::to_string(port) +
                          ", and new subscribers would then not be found; choose a domain up to "
                          "101, or reserve the port: sysctl -w net.ipv4.ip_local_reserved_ports=" +
                          std::to_string(port));
}

Dds ReadDds(const YamlNode& node, LoadContext& context) {
  Dds dds;
  Problems& problems = context.problems;
  MapReader map(node, "dds", problems);
  map.Read<&Dds::enabled, &Dds::domain, &Dds::write, &Dds::heartbeat, &Dds::lease>(dds);
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
      problems.Error(
          interfaces->mark(),
          "interfaces: the list is empty, so no participant could be reached; write [127.0.0.1]");
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

/// True for a name that Prometheus takes: letters, digits and _, not a digit first.
bool IsLabelName(std::string_view name) {
  const auto letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  const auto fits = [&](char c) { return letter(c) || (c >= '0' && c <= '9'); };
  return !name.empty() && letter(name[0]) && !name.starts_with("__") &&
         std::ranges::all_of(name, fits);
}

void ReadLabels(const YamlNode& node, RemoteWrite& remote, Problems& problems) {
  constexpr std::size_t kMostLabels = 20;
  constexpr std::size_t kLongestLabel = 200;
  // The labels that the series have already (gateway/outputs/remote_write/series.cpp).
  constexpr std::array<std::string_view, 5> kTaken = {"gateway", "line", "device", "point", "unit"};
  for (const Entry& entry : ReadEntries(node, "labels", problems)) {
    const std::string& name = entry.key;
    const Mark mark = node.source()->MarkAt(entry.place);
    if (!IsLabelName(name)) {
      problems.Error(mark, "labels: " + Quoted(name) +
                               " is not the name of a label; use letters, digits and _");
    } else if (std::ranges::find(kTaken, name) != kTaken.end()) {
      problems.Error(mark, "labels: every series has the label " + name +
                               " already; choose another name, for example plant_" + name);
    } else if (auto text = ReadText(entry.value, name, problems)) {
      if (text->empty() || text->size() > kLongestLabel) {
        problems.Error(entry.value.mark(),
                       name + ": a label needs 1 to " + std::to_string(kLongestLabel) + " bytes");
      }
      remote.labels.push_back({name, std::move(*text)});
    }
  }
  if (remote.labels.size() > kMostLabels) {
    problems.Error(node.mark(),
                   "labels: at most " + std::to_string(kMostLabels) + " labels are allowed");
  }
}

/// Reads the key `remote_write`: a database that gets the values of the history.
///
///   remote_write:
///     url: https://tsdb.example/api/v1/write
///     labels: { site: north }
///     user: gate
///     password: { file: /etc/baudgate/remote_write.password }
///     ca: /etc/baudgate/remote_write-ca.pem
RemoteWrite ReadRemoteWrite(const YamlNode& node, Problems& problems) {
  constexpr char kUrl[] = "https://tsdb.example/api/v1/write";
  constexpr char kPassword[] = "/etc/baudgate/remote_write.password";
  RemoteWrite remote;
  remote.on = true;
  remote.mark = node.mark();
  MapReader map(node, "remote_write", problems);
  if (node.kind() != YamlNode::Kind::map) return remote;
  map.Need("url", kUrl);
  if (const auto url = map.Label("url")) {
    const bool https = url->starts_with("https://");
    const std::string place = url->substr(std::min(url->size(), url->find("://") + 3));
    const std::string host = place.substr(0, place.find('/'));
    if ((!https && !url->starts_with("http://")) || host.empty()) {
      problems.Error(map.MarkOf("url"),
                     "url: is not an address of the web; write for example " + std::string(kUrl));
    } else if (host.find('@') != std::string::npos) {
      // The message must not show the password that the address can contain.
      problems.Error(map.MarkOf("url"),
                     "url: contains a user name; write the keys user and password instead");
    }
    remote.url = *url;
    if (map.Has("ca") && !https) {
      problems.Error(map.MarkOf("ca"),
                     "ca: has no effect, because url does not begin with "
                     "https://; remove ca, or call the receiver with https");
    }
  }
  if (const auto labels = map.Get("labels")) ReadLabels(*labels, remote, problems);
  if (const auto user = map.Label("user")) remote.user = *user;
  if (const auto password = map.Get("password")) {
    MapReader its(*password, "password", problems);
    if (password->kind() == YamlNode::Kind::map) {
      its.Need("file", kPassword);
      remote.password_file = ReadAbsolutePath(its, "file", kPassword);
      remote.password_mark = its.MarkOf("file");
      its.Finish();
    }
    if (remote.user.empty()) {
      problems.Error(map.MarkOf("password"), "password: has no effect without user; add user");
    }
  } else if (!remote.user.empty()) {
    map.Need("password", std::string("{ file: ") + kPassword + " }");
  }
  remote.ca = ReadAbsolutePath(map, "ca", "/etc/baudgate/remote_write-ca.pem");
  map.Finish();
  return remote;
}

}  // namespace

void ReadOutputs(MapReader& map, Config& config, LoadContext& context) {
  if (const auto node = map.Get("dds")) config.dds = ReadDds(*node, context);
  if (const auto node = map.Get("mqtt")) config.mqtt = ReadMqtt(*node, config, context.problems);
  if (const auto node = map.Get("remote_write")) {
    config.remote_write = ReadRemoteWrite(*node, context.problems);
  }
  if (const auto node = map.Get("users")) config.users = ReadUsers(*node, context.problems);
  if (const auto node = map.Get("web")) {
    config.web = ReadWeb(*node, !config.users.file.empty(), context.problems);
  }
}

}  // namespace baudgate::config
