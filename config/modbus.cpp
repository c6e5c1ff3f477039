// SPDX-License-Identifier: Apache-2.0
#include "config/modbus.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "config/checks/line_checks.h"
#include "config/checks/modbus_checks.h"
#include "config/events.h"
#include "config/files.h"
#include "config/lines.h"
#include "config/model/config.h"
#include "config/model/network.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

void ReadTargetLine(const YamlNode& node, const std::vector<Line>& lines, Route& route,
                    LoadContext& context) {
  const auto name = ReadText(node, "line", context.problems);
  if (!name) return;
  const auto line =
      std::find_if(lines.begin(), lines.end(), [&](const Line& one) { return one.name == *name; });
  if (name->empty() || line == lines.end()) {
    std::vector<std::string_view> names;
    for (const Line& one : lines) {
      if (!one.name.empty()) names.push_back(one.name);
    }
    context.problems.Error(node.mark(), "line: there is no line " + Quoted(*name) + ";" +
                                            DidYouMean(*name, names) +
                                            " lines: " + (names.empty() ? "none" : Join(names)));
    return;
  }
  route.line = *name;
  route.line_index = static_cast<std::size_t>(line - lines.begin());
  const protocols::Protocol* protocol = context.catalog.FindProtocol(line->protocol);
  if (!protocol || protocol->carrier) return;
  if (protocol->tcp) {
    context.problems.Error(
        node.mark(),
        "line: '" + *name +
            "' is a Modbus TCP server, which a route reaches without a line; write server: \"" +
            (!line->is_network()        ? "host:502"
             : IsTlsAddress(line->port) ? line->port
                                        : line->port.substr(kTcpScheme.size())) +
            "\" in place of line");
    return;
  }
  std::vector<std::string_view> carriers;
  for (const auto& [known, one] : context.catalog.protocols) {
    if (one->carrier) carriers.push_back(known);
  }
  context.problems.Error(
      node.mark(), "line: '" + *name + "' uses " + line->protocol +
                       ", which cannot carry Modbus requests; installed protocols that can: " +
                       (carriers.empty() ? "none" : Join(carriers)));
}

/// Returns true if the server is called over TLS.
bool ReadTargetServer(const YamlNode& node, const std::vector<Listener>& listeners, Route& route,
                      Problems& problems) {
  bool secure = false;
  const auto server = ReadParsed(node, "server", problems, [&](const std::string& text) {
    constexpr std::uint16_t kSecurePort = 802;
    if (!IsTlsAddress(text)) return ParseServer(text, route.port);
    secure = true;
    return ParseServer(std::string_view(text).substr(kTlsScheme.size()), kSecurePort);
  });
  if (!server) return secure;
  route.host = server->host == "localhost" ? "127.0.0.1" : server->host;
  route.port = server->port;
  CheckServer(route, listeners, node.mark(), problems);
  return secure;
}

}  // namespace

Route ReadRoute(const YamlNode& node, const std::vector<Listener>& listeners,
                const std::vector<Line>& lines, LoadContext& context) {
  Route route;
  route.mark = node.mark();
  MapReader map(node, "a route", context.problems);
  if (node.kind() != YamlNode::Kind::map) return route;
  const auto node_of_units = map.Need("units", "20");
  const auto units = node_of_units
                         ? ReadParsed(*node_of_units, "units", context.problems, ParseUnits)
                         : std::nullopt;
  if (units) std::tie(route.first, route.last) = *units;
  if (const auto line = map.Get("line")) ReadTargetLine(*line, lines, route, context);
  bool secure = false;
  if (const auto server = map.Get("server")) {
    secure = ReadTargetServer(*server, listeners, route, context.problems);
  }
  route.tls = ReadClientTls(map, secure, "modbus");
  map.Read<&Route::remap, &Route::deadline>(route);
  route.alarms =
      ReadAlarmSetting(map, route.line.empty() ? context.alarms : lines[route.line_index].alarms);
  map.Finish();
  const Keys keys = map.keys();
  CheckTarget(keys, context.problems);
  if (units) CheckRoute(route, keys, context.problems);
  return route;
}

namespace {

constexpr std::size_t kMostNetworks = 1000;
constexpr std::size_t kMostRules = 100;

constexpr std::array<Word<Permit>, 2> kWrite = {{{"allow", Permit::all}, {"deny", Permit::read}}};

void SetFraming(Listener& listener, modbus::Framing framing, const Catalog& catalog) {
  listener.framing = framing;
  if (const protocols::Protocol* frames = catalog.FramesOf(framing))
    listener.serial = frames->serial;
}

Result<HostPort> ParseOwnAddress(const std::string& text, const std::string& example) {
  auto at = ParseHostPort(text, example);
  if (!at) return at;
  if (at->host == "localhost") at->host = "127.0.0.1";
  if (IsIpAddress(at->host)) return at;
  return Error{
      Quoted(at->host) +
      " is not an IP address; write an IP address of this machine, or 0.0.0.0 for all addresses"};
}

void ReadAt(const YamlNode& node, const std::string& what, Listener& listener,
            LoadContext& context) {
  const auto text = ReadText(node, what, context.problems);
  if (!text) return;
  if (text->starts_with('/')) {
    listener.path = *text;
    SetFraming(listener, modbus::Framing::rtu, context.catalog);
    listener.errors = Listener::Errors::silent;
    return;
  }
  const auto at = ParseOwnAddress(*text, "127.0.0.1:1502");
  if (!at) {
    const bool no_colon = text->find(':') == std::string::npos;
    context.problems.Error(
        node.mark(), what + ": " + at.error() + (no_colon ? ", or /dev/ttyUSB4" : std::string()));
    return;
  }
  listener.host = at->host;
  listener.port = at->port;
}

// Reads a list whose brackets may be omitted if it has one element.
std::vector<YamlNode> ReadSome(const YamlNode& node, const std::string& what, std::size_t most,
                               const std::string& when_empty, Problems& problems) {
  if (node.kind() == YamlNode::Kind::scalar) return {node};
  auto some = ReadList(node, what, most, problems);
  if (node.kind() == YamlNode::Kind::list && some.empty()) {
    problems.Error(node.mark(), what + ": " + when_empty);
  }
  return some;
}

/// The value of `allow` that admits every machine on purpose, so `check` does not warn of it.
constexpr std::string_view kEverybody = "everybody";

void ReadPermit(MapReader& map, Listener& listener) {
  const auto write = map.OneOf("write", kWrite);
  const auto permit = map.OneOf("permit", kWords<Permit>);
  Assign(listener.permit, write);
  Assign(listener.permit, permit);
  if (!write || !permit || (*write == Permit::read) == (*permit == Permit::read)) return;
  const std::string word = *write == Permit::read ? "deny" : "allow";
  map.problems().Error(map.MarkOf("write"),
                       "write: " + word + " contradicts permit: " + std::string(Name(*permit)) +
                           "; remove one of them");
}

void NeedPriority(MapReader& map, Priority& priority) {
  if (map.Need("priority", "high")) Assign(priority, map.OneOf("priority", kWords<Priority>));
}

void ReadClients(const YamlNode& node, Listener& listener, Problems& problems) {
  for (const YamlNode& one : ReadList(node, "clients", kMostRules, problems)) {
    ClientPriority client;
    MapReader map(one, "an entry of clients", problems);
    if (one.kind() != YamlNode::Kind::map) continue;
    const auto from = map.Need("from", "10.0.0.7");
    const auto network = from ? ReadParsed(*from, "from", problems, ParseNetwork) : std::nullopt;
    NeedPriority(map, client.priority);
    map.Finish();
    if (!network) continue;
    client.from = *network;
    CheckClient(client, listener, from->mark(), problems);
    listener.clients.push_back(client);
  }
}

using Codes = std::bitset<128>;

std::vector<std::uint8_t> ReadCodes(const YamlNode& list, const std::string& key, Codes& known,
                                    Problems& problems) {
  std::vector<std::uint8_t> codes;
  for (const YamlNode& node :
       ReadSome(list, key, known.size(), "the list is empty; write for example [5, 6, 15, 16]",
                problems)) {
    const auto code = ReadInteger(node, key, 1, 127, problems);
    if (!code) continue;
    codes.push_back(static_cast<std::uint8_t>(*code));
    if (known[codes.back()]) {
      problems.Error(node.mark(), key + ": " + std::to_string(*code) + " occurs twice");
    }
    known.set(codes.back());
  }
  return codes;
}

void ReadFunctions(const YamlNode& node, Listener& listener, Problems& problems) {
  Codes known;
  for (const YamlNode& one : ReadList(node, "functions", kMostRules, problems)) {
    FunctionPriority functions;
    MapReader map(one, "an entry of functions", problems);
    if (one.kind() != YamlNode::Kind::map) continue;
    const auto codes = map.Need("codes", "[5, 6, 15, 16]");
    if (codes) functions.codes = ReadCodes(*codes, "codes", known, problems);
    NeedPriority(map, functions.priority);
    map.Finish();
    listener.functions.push_back(std::move(functions));
  }
}

constexpr std::array<std::string_view, 2> kRights = {"read", "write"};

/// Parses "20" or "33-40"; the numbers are at most `most`.
Result<RoleRule::Range> ParseRange(const std::string& text, std::uint16_t most) {
  const std::size_t dash = text.find('-');
  const auto first = ParseInteger<std::uint16_t>(text.substr(0, dash));
  const auto last =
      dash == std::string::npos ? first : ParseInteger<std::uint16_t>(text.substr(dash + 1));
  if (first && last && *first <= *last && *last <= most) return RoleRule::Range{*first, *last};
  return Error{Quoted(text) + " is no number or range of 0…" + std::to_string(most) +
               "; write for example 20 or 33-40"};
}

std::vector<RoleRule::Range> ReadRanges(MapReader& map, const std::string& key,
                                        std::uint16_t most) {
  std::vector<RoleRule::Range> ranges;
  const auto list = map.Get(key);
  if (!list) return ranges;
  for (const YamlNode& one :
       ReadSome(*list, key, kMostRules, "the list is empty; remove the key to permit all",
                map.problems())) {
    const auto range = ReadParsed(one, key, map.problems(), [most](const std::string& text) {
      return ParseRange(text, most);
    });
    if (range) ranges.push_back(*range);
  }
  return ranges;
}

std::vector<RoleRule> ReadRules(const YamlNode& list, const std::string& role, Problems& problems) {
  std::vector<RoleRule> rules;
  for (const YamlNode& one : ReadList(list, role, kMostRules, problems)) {
    MapReader map(one, "an entry of role " + Quoted(role), problems);
    if (one.kind() != YamlNode::Kind::map) continue;
    RoleRule rule;
    rule.units = ReadRanges(map, "units", 255);
    Codes known;
    if (const auto codes = map.Get("functions")) {
      rule.functions = ReadCodes(*codes, "functions", known, problems);
    }
    rule.addresses = ReadRanges(map, "addresses", 65535);
    map.Finish();
    if (map.keys().values.empty()) {
      problems.Error(one.mark(), role +
                                     ": an empty rule would permit everything; name units, "
                                     "functions or addresses, or write the word write in place "
                                     "of the list");
    }
    rules.push_back(std::move(rule));
  }
  if (rules.empty()) {
    problems.Error(list.mark(),
                   role + ": the list permits nothing; remove the role, or write read");
  }
  return rules;
}

/// Reads the rights of roles: `read`, `write`, or a list of rules.
///
///   roles:
///     viewer: read
///     operator: write
///     pump: [{ units: 7, functions: [3, 6], addresses: 100-119 }]
std::vector<RoleRights> ReadRoles(const YamlNode& node, Problems& problems) {
  std::vector<RoleRights> roles;
  const auto entries = ReadEntries(node, "roles", problems);
  if (node.kind() == YamlNode::Kind::map && entries.empty()) {
    problems.Error(node.mark(), "roles: no role has rights; write for example viewer: read");
  }
  for (const Entry& entry : entries) {
    RoleRights rights{.role = entry.key};
    if (entry.value.kind() == YamlNode::Kind::list) {
      rights.rules = ReadRules(entry.value, entry.key, problems);
    } else if (const auto right = ReadChoice(entry.value, entry.key, kRights, problems)) {
      rights.permit = *right == 0 ? Permit::read : Permit::all;
    }
    roles.push_back(std::move(rights));
  }
  return roles;
}

/// The roles of users (gateway/base/role.h) have rights without `roles`. An auditor reads no
/// values.
std::vector<RoleRights> UsualRoles() {
  return {{.role = "viewer", .permit = Permit::read},
          {.role = "operator", .permit = Permit::all},
          {.role = "engineer", .permit = Permit::all}};
}

void ReadSecurity(MapReader& map, Listener& listener) {
  map.Read<&Listener::protocol>(listener);
  const bool on = listener.protocol == Listener::Protocol::tls;
  listener.tls = ReadMutualTls(map, on);
  if (!on) return;
  const auto roles = map.Get("roles");
  listener.roles = roles ? ReadRoles(*roles, map.problems()) : UsualRoles();
  if (listener.speaks_serial()) {
    map.problems().Error(map.MarkOf("framing"),
                         "framing: Modbus/TCP Security has the frames of Modbus TCP; remove the "
                         "key, or protocol: tls");
  }
}

void ReadNetworkSide(MapReader& map, Listener& listener) {
  for (const std::string key : {"serial", "parity", "rs485", "echo"}) {
    map.Refuse(key, key +
                        ": applies only to a listener at a serial port; write for example at: "
                        "/dev/ttyUSB4, or remove the key");
  }
  map.Read<&Listener::framing>(listener);
  if (const auto allow = map.Get("allow")) {
    const bool everybody = allow->kind() == YamlNode::Kind::scalar && allow->text() == kEverybody;
    listener.allow = everybody ? std::vector{*ParseNetwork("0.0.0.0/0"), *ParseNetwork("::/0")}
                               : ReadAllow(*allow, "allow", map.problems());
  }
  if (const auto clients = map.Get("clients")) ReadClients(*clients, listener, map.problems());
  map.Read<&Listener::max_clients, &Listener::idle_timeout>(listener);
  ReadSecurity(map, listener);
}

// Reads the key `echo` of a listener. Only lines allow `verify`, because there the gateway sends
// requests and can fail an exchange whose echo is wrong.
void ReadEcho(MapReader& map, Listener& listener) {
  const auto node = map.Get("echo");
  if (!node) return;
  if (node->kind() == YamlNode::Kind::scalar && node->text() == "verify") {
    map.problems().Error(node->mark(),
                         "echo: verify is for lines only; at a listener write strip if its adapter "
                         "returns sent bytes, or off");
    return;
  }
  map.Read<&Listener::echo>(listener);
}

void ReadSerialSide(MapReader& map, Listener& listener, const Catalog& catalog) {
  for (const std::string key : {"allow", "clients", "max_clients", "idle_timeout", "protocol",
                                "certificate", "key", "ca", "roles"}) {
    map.Refuse(
        key,
        key + ": does not apply to a serial port, which has exactly one master; remove the key");
  }
  if (const auto framing = map.OneOf("framing", kWords<modbus::Framing>)) {
    if (*framing != modbus::Framing::tcp) {
      SetFraming(listener, *framing, catalog);
    } else {
      map.problems().Error(
          map.MarkOf("framing"),
          "framing: tcp cannot be used at a serial port; write rtu or ascii, or remove the key");
    }
  }
  if (const auto serial = map.Get("serial")) {
    listener.serial = ReadSerial(*serial, listener.serial, map.problems());
  }
  ReadSerialExtras(map, listener.serial);
  ReadEcho(map, listener);
  if (const protocols::Protocol* frames = catalog.FramesOf(listener.framing)) {
    CheckDataBits(listener.serial, *frames, map.MarkOf("serial"), map.problems());
  }
}

void ReadKeys(MapReader& map, Listener& listener, LoadContext& context) {
  if (const auto at = map.Get("at")) ReadAt(*at, "at", listener, context);
  if (listener.is_serial()) {
    ReadSerialSide(map, listener, context.catalog);
  } else {
    ReadNetworkSide(map, listener);
  }
  ReadPermit(map, listener);
  map.Read<&Listener::priority>(listener);
  if (const auto functions = map.Get("functions")) {
    ReadFunctions(*functions, listener, context.problems);
  }
  map.Read<&Listener::errors, &Listener::broadcast, &Listener::holes>(listener);
  map.Finish();
}

}  // namespace

std::vector<Network> ReadAllow(const YamlNode& node, const std::string& key, Problems& problems) {
  std::vector<Network> networks;
  for (const YamlNode& range :
       ReadSome(node, key, kMostNetworks,
                "an empty list admits no client; remove the key to allow all clients", problems)) {
    const auto network = ReadParsed(range, key, problems, ParseNetwork);
    if (network) networks.push_back(*network);
  }
  return networks;
}

std::vector<Network> ReadNetworks(const YamlNode& node, const std::string& key,
                                  Problems& problems) {
  const bool is_empty =
      node.kind() == YamlNode::Kind::list && ReadList(node, key, kMostNetworks, problems).empty();
  return is_empty ? std::vector<Network>() : ReadAllow(node, key, problems);
}

std::optional<HostPort> ReadOwnAddress(const YamlNode& node, const std::string& key,
                                       const std::string& example, Problems& problems) {
  return ReadParsed(node, key, problems,
                    [&](const std::string& text) { return ParseOwnAddress(text, example); });
}

Listener ReadListener(const YamlNode& node, LoadContext& context) {
  Listener listener;
  listener.mark = node.mark();
  if (node.kind() == YamlNode::Kind::scalar) {
    ReadAt(node, "listen", listener, context);
  } else {
    MapReader map(node, "listen", context.problems);
    ReadKeys(map, listener, context);
  }
  CheckListener(listener, context.catalog, context.problems);
  if (listener.is_serial()) {
    context.uniques.ListenerPort(listener.path, listener.mark);
  } else {
    context.uniques.Address("listen", {listener.host, listener.port}, listener.mark);
  }
  return listener;
}

}  // namespace baudgate::config
