// Tests every key of a listener at a TCP port and at a serial port.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "config/lines.h"
#include "config/loader.h"
#include "config/model/config.h"
#include "config/model/network.h"
#include "config/outputs.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::Listener;
using config::Permit;
using config::Priority;
using ::testing::HasSubstr;

constexpr const char* kDrive =
    "lines:\n"
    "- { name: drive, port: /dev/l, protocol: modbus_rtu, devices: [{ name: d, address: 1, "
    "points: [{ name: p, read: A1, type: int16 }] }] }\n";

config::Loaded LoadListener(const std::string& keys) {
  return LoadModbus("modbus: { listen: { " + keys + " } }\n" + kDrive);
}

Listener ListenerOf(const std::string& keys) {
  const auto loaded = LoadListener(keys);
  EXPECT_EQ(Shown(loaded.problems), "") << keys;
  return loaded.config.modbus.listen.at(0);
}

TEST(Listeners, MissingKeysGetTheirDefaults) {
  const Listener listener = ListenerOf("at: \"127.0.0.1:1502\"");
  EXPECT_FALSE(listener.is_serial());
  EXPECT_EQ(listener.Address(), "127.0.0.1:1502");
  EXPECT_EQ(listener.framing, modbus::Framing::tcp);
  EXPECT_EQ(listener.permit, Permit::all);
  EXPECT_EQ(listener.priority, Priority::normal);
  EXPECT_EQ(listener.errors, Listener::Errors::exception);
  EXPECT_EQ(listener.broadcast, Listener::Broadcast::ignore);
  EXPECT_TRUE(listener.allow.empty() && listener.clients.empty() && listener.functions.empty());
}

TEST(Listeners, RtuFramingOverTcpIsRead) {
  const Listener listener = ListenerOf("at: \"0.0.0.0:2101\", framing: rtu, errors: silent");
  EXPECT_EQ(listener.framing, modbus::Framing::rtu);
  EXPECT_EQ(listener.errors, Listener::Errors::silent);
  EXPECT_EQ(ListenerOf("framing: rtu").errors, Listener::Errors::exception);
}

TEST(Listeners, HolesAreOffByDefault) {
  EXPECT_EQ(ListenerOf("permit: all").holes, Listener::Holes::off);
  EXPECT_EQ(ListenerOf("holes: zero").holes, Listener::Holes::zero);
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4, holes: zero").holes, Listener::Holes::zero);
}

TEST(Listeners, PermitAndWriteSetThePermission) {
  EXPECT_EQ(ListenerOf("permit: read").permit, Permit::read);
  EXPECT_EQ(ListenerOf("permit: data").permit, Permit::data);
  EXPECT_EQ(ListenerOf("permit: all").permit, Permit::all);
  EXPECT_EQ(ListenerOf("write: deny").permit, Permit::read);
  EXPECT_EQ(ListenerOf("write: allow").permit, Permit::all);
  EXPECT_EQ(ListenerOf("write: allow, permit: data").permit, Permit::data);
  EXPECT_EQ(ListenerOf("write: deny, permit: read").permit, Permit::read);
}

TEST(Listeners, PriorityRulesAreRead) {
  const Listener listener = ListenerOf(
      "priority: low, clients: [{ from: 10.0.0.7, priority: high }, { from: 10.0.0.0/8, "
      "priority: normal }], functions: [{ codes: [5, 6, 15, 16], priority: high }, { codes: "
      "127, priority: low }]");
  EXPECT_EQ(listener.priority, Priority::low);
  ASSERT_EQ(listener.clients.size(), 2U);
  EXPECT_EQ(listener.clients[0].from.text, "10.0.0.7");
  EXPECT_EQ(listener.clients[0].from.prefix, 128);
  EXPECT_EQ(listener.clients[0].priority, Priority::high);
  EXPECT_EQ(listener.clients[1].priority, Priority::normal);
  ASSERT_EQ(listener.functions.size(), 2U);
  EXPECT_EQ(listener.functions[0].codes, (std::vector<std::uint8_t>{5, 6, 15, 16}));
  EXPECT_EQ(listener.functions[0].priority, Priority::high);
  EXPECT_EQ(listener.functions[1].codes, (std::vector<std::uint8_t>{127}));
}

TEST(Listeners, ASerialPortHasItsOwnDefaults) {
  const Listener listener = ListenerOf(
      "at: /dev/ttyUSB4, serial: 38400 7O1, parity: software, rs485: { delay_after_send: 1ms "
      "}, permit: data, priority: high, functions: [{ codes: [6], priority: low }]");
  EXPECT_TRUE(listener.is_serial());
  EXPECT_EQ(listener.Address(), "/dev/ttyUSB4");
  EXPECT_EQ(listener.serial.ToString(), "38400 7O1");
  EXPECT_TRUE(listener.serial.software_parity);
  EXPECT_TRUE(listener.serial.rs485.enabled);
  EXPECT_EQ(listener.framing, modbus::Framing::rtu);
  EXPECT_EQ(listener.errors, Listener::Errors::silent);
  EXPECT_EQ(listener.permit, Permit::data);
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4, errors: exception, framing: rtu").errors,
            Listener::Errors::exception);
}

TEST(Listeners, EchoIsOffByDefault) {
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4").echo, Listener::Echo::off);
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4, echo: off").echo, Listener::Echo::off);
  EXPECT_EQ(ListenerOf("at: /dev/ttyUSB4, echo: strip").echo, Listener::Echo::strip);
}

TEST(Listeners, ASerialPortAsTextHasTheSettingsOfTheProtocol) {
  const auto loaded = LoadModbus(std::string("modbus: { listen: [/dev/ttyUSB4] }\n") + kDrive);
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(loaded.config.modbus.listen.at(0).path, "/dev/ttyUSB4");
  EXPECT_EQ(loaded.config.modbus.listen.at(0).serial.ToString(), "19200 8E1");
  EXPECT_EQ(loaded.config.modbus.listen.at(0).errors, Listener::Errors::silent);
}

TEST(Listeners, BroadcastIsRead) {
  const std::string with_route =
      "modbus: { listen: { broadcast: pass }, routes: [{ units: 20, line: drive }] }\n";
  const auto loaded = LoadModbus(with_route + kDrive);
  EXPECT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(loaded.config.modbus.listen.at(0).broadcast, Listener::Broadcast::pass);
  EXPECT_EQ(ListenerOf("broadcast: ignore").broadcast, Listener::Broadcast::ignore);
}

TEST(Network, ANetworkCoversTheNetworksInsideIt) {
  const auto covers = [](const char* outer, const char* inner) {
    return config::Covers(*config::ParseNetwork(outer), *config::ParseNetwork(inner));
  };
  EXPECT_TRUE(covers("10.0.0.0/8", "10.255.0.1"));
  EXPECT_TRUE(covers("10.0.0.7", "10.0.0.7"));
  EXPECT_FALSE(covers("10.0.0.0/8", "11.0.0.1"));
  EXPECT_FALSE(covers("10.0.0.0", "10.0.0.0/8"));
  EXPECT_FALSE(covers("::1", "10.0.0.7"));
}

TEST(Network, ServersMayOmitThePort) {
  const auto shown = [](const char* text) {
    const auto at = config::ParseServer(text, 502);
    return at ? at->host + " " + std::to_string(at->port) : at.error();
  };
  EXPECT_EQ(shown("10.0.0.9:1502"), "10.0.0.9 1502");
  EXPECT_EQ(shown("10.0.0.9"), "10.0.0.9 502");
  EXPECT_EQ(shown("plc-7"), "plc-7 502");
  EXPECT_EQ(shown("::1"), "::1 502");
  EXPECT_EQ(shown("[::1]"), "::1 502");
  EXPECT_EQ(shown("[::1]:7"), "::1 7");
  EXPECT_EQ(shown("a b"), "'a b' is not a server; write for example 10.0.0.9:502");
  EXPECT_EQ(shown(""), "'' is not a server; write for example 10.0.0.9:502");
  EXPECT_EQ(shown("x:0"), "'x:0' has no usable port number; allowed: 1…65535");
}

using config::Route;

constexpr const char* kRoutedLines =
    "lines:\n"
    "- { name: bay, port: /dev/a, protocol: fake, devices: [{ name: d, address: 1, unit: 36, "
    "profile: relay }] }\n"
    "- { name: drive, port: /dev/b, protocol: modbus_rtu }\n"
    "- { name: text, port: /dev/c, protocol: modbus_ascii }\n";

/// `routes` begin in line 2, column 12. Two more routes are added, because each line needs a route.
config::Loaded LoadRoutes(const std::string& routes) {
  return LoadModbus("modbus: {\n  routes: [ " + routes +
                    ", { units: 201, line: drive }, { units: 202, line: text } ] }\n" +
                    kRoutedLines);
}

Route One(const std::string& keys) {
  const auto loaded = LoadRoutes("{ " + keys + " }");
  EXPECT_EQ(Shown(loaded.problems), "") << keys;
  return loaded.config.modbus.routes.at(0);
}

TEST(Routes, ARouteToALineIsRead) {
  const Route route = One("units: \"20\", line: drive");
  EXPECT_EQ(route.first, 20);
  EXPECT_EQ(route.last, 20);
  EXPECT_EQ(route.line, "drive");
  EXPECT_EQ(route.line_index, 1U);
  EXPECT_EQ(route.host, "");
  EXPECT_FALSE(route.remap);
  EXPECT_EQ(route.deadline, 2500ms);
  EXPECT_EQ(route.mark.ToString(), "t.yaml:2:13");
  EXPECT_EQ(One("units: 20, line: text").line_index, 2U);
}

TEST(Routes, RangesAreReadAndRemapped) {
  const Route route = One("units: \"37-40\", line: drive, remap: 1, deadline: 1s");
  EXPECT_EQ(route.Units(), "37-40");
  EXPECT_EQ(route.SlaveOf(37), 1);
  EXPECT_EQ(route.SlaveOf(40), 4);
  EXPECT_EQ(route.deadline, 1s);
  EXPECT_EQ(One("units: 37 - 40, line: drive").Units(), "37-40");
  EXPECT_EQ(One("units: 1, line: drive, remap: 247").SlaveOf(1), 247);
  EXPECT_EQ(One("units: 250-255, line: drive, remap: 242").SlaveOf(255), 247);
  EXPECT_EQ(One("units: 248-255, line: drive").SlaveOf(255), 255) << "some slaves are there";
  EXPECT_EQ(One("units: 1, line: drive, remap: 255").SlaveOf(1), 255);
}

TEST(Routes, ARouteToAServerIsRead) {
  const Route route = One("units: \"50-59\", server: \"10.0.0.9:1502\", deadline: 50ms");
  EXPECT_EQ(route.line, "");
  EXPECT_EQ(route.host, "10.0.0.9");
  EXPECT_EQ(route.port, 1502);
  EXPECT_EQ(route.deadline, 50ms);
  EXPECT_EQ(One("units: 50, server: 10.0.0.9").port, 502);
  EXPECT_EQ(One("units: 50, server: plc").host, "plc");
  EXPECT_EQ(One("units: 255, server: plc, remap: 1").SlaveOf(255), 1);
  EXPECT_EQ(One("units: 248-254, server: plc, remap: 249").SlaveOf(254), 255);
  EXPECT_EQ(One("units: 50, server: plc, remap: 0").SlaveOf(50), 0);
  EXPECT_EQ(One("units: 0, server: plc, remap: 0").SlaveOf(0), 0) << "a write is no broadcast then";
}

TEST(Routes, UnitZeroIsUnchangedOrRemapped) {
  EXPECT_EQ(One("units: 0, line: drive").SlaveOf(0), 0);
  EXPECT_EQ(One("units: 0, line: drive, remap: 1").SlaveOf(0), 1);
  EXPECT_EQ(One("units: 0-5, line: drive").first, 0);
}

TEST(Routes, RoutesKeepTheirOrder) {
  const auto loaded = LoadRoutes("{ units: 9, line: text }, { units: 7, line: drive }");
  ASSERT_EQ(loaded.config.modbus.routes.size(), 4U);
  EXPECT_EQ(loaded.config.modbus.routes[0].first, 9);
  EXPECT_EQ(loaded.config.modbus.routes[1].first, 7);
}

TEST(Units, AreShownAsRanges) {
  const auto text = [](std::initializer_list<std::size_t> units) {
    config::UnitSet set;
    for (const std::size_t unit : units) set.set(unit);
    return config::UnitsText(set);
  };
  EXPECT_EQ(text({}), "");
  EXPECT_EQ(text({0}), "0");
  EXPECT_EQ(text({33, 34, 35, 37, 254, 255}), "33-35, 37, 254-255");
}

constexpr const char* kLines =
    "lines:\n"
    "- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1, profile: relay }] "
    "}\n";

config::Loaded LoadOutputs(const std::string& text) { return Load(text + "\n" + kLines); }

config::Config Good(const std::string& text) {
  const auto loaded = LoadOutputs(text);
  EXPECT_EQ(Shown(loaded.problems), "") << text;
  return loaded.config;
}

TEST(Gateway, RecordingsAndSocketAreAbsolutePaths) {
  const auto config = Good("gateway: { recordings: /var/x, socket: /run/x.sock }");
  EXPECT_EQ(config.name, "baudgate");
  EXPECT_EQ(config.recordings, "/var/x");
  EXPECT_EQ(config.socket, "/run/x.sock");
  EXPECT_EQ(Good("gateway: { name: g }").recordings, "");
  EXPECT_EQ(Good("gateway: { name: g }").socket, "");
  EXPECT_EQ(Shown(LoadOutputs("gateway: { socket: /" + std::string(107, 'x') + " }").problems),
            "t.yaml:1:20: error: socket: the path is too long; at most 107 bytes\n");
  EXPECT_TRUE(LoadOutputs("gateway: { socket: /" + std::string(106, 'x') + " }").ok());
}

TEST(Outputs, ListenersAreReadAsTextMapAndList) {
  const auto text = Good("modbus: { listen: \"0.0.0.0:502\" }").modbus;
  EXPECT_EQ(text.listen.at(0).host, "0.0.0.0");
  EXPECT_EQ(text.listen.at(0).port, 502);
  EXPECT_EQ(text.listen.at(0).permit, config::Permit::all);
  const auto map =
      Good(
          "modbus: { listen: { at: \"[fd00::1]:1502\", allow: 10.0.0.0/8, write: deny, "
          "priority: high, max_clients: 3, idle_timeout: 1min } }")
          .modbus;
  EXPECT_EQ(map.listen.at(0).host, "fd00::1");
  EXPECT_EQ(map.listen.at(0).allow.at(0).text, "10.0.0.0/8");
  EXPECT_EQ(map.listen.at(0).permit, config::Permit::read);
  EXPECT_EQ(map.listen.at(0).priority, config::Priority::high);
  EXPECT_EQ(map.listen.at(0).max_clients, 3);
  EXPECT_EQ(map.listen.at(0).idle_timeout, 1min);
  const auto list = Good("modbus: { listen: [\"127.0.0.1:1\", { at: \"127.0.0.1:2\" }] }").modbus;
  ASSERT_EQ(list.listen.size(), 2U);
  EXPECT_EQ(list.listen[1].port, 2);
}

TEST(Outputs, OutputsCanBeSwitchedOff) {
  const auto config = Good("modbus: { enabled: false }\ndds: { enabled: no }");
  EXPECT_FALSE(config.modbus.enabled);
  EXPECT_FALSE(config.dds.enabled);
}

TEST(Outputs, DdsKeysAreRead) {
  const auto dds =
      Good(
          "dds: { domain: 7, interfaces: [10.0.0.1, \"::1\"], heartbeat: 2s, lease: 15s, peers: "
          "[10.0.0.7], "
          "multicast: false, discovery_servers: [\"10.0.0.8:11811\", \"localhost:7\"] }")
          .dds;
  EXPECT_EQ(dds.domain, 7);
  for (const char* domain : {"101", "215", "232"}) {
    EXPECT_TRUE(Good("dds: { domain: " + std::string(domain) + " }").dds.enabled) << domain;
  }
  EXPECT_EQ(dds.interfaces, (std::vector<std::string>{"10.0.0.1", "::1"}));
  EXPECT_EQ(dds.peers, std::vector<std::string>{"10.0.0.7"});
  EXPECT_FALSE(dds.multicast);
  EXPECT_EQ(dds.discovery_servers,
            (std::vector<config::HostPort>{{"10.0.0.8", 11811}, {"127.0.0.1", 7}}));
  EXPECT_EQ(dds.heartbeat, 2s);
  EXPECT_EQ(dds.lease, 15s);
  EXPECT_FALSE(Good("dds: { domain: 1 }").dds.write);
  EXPECT_FALSE(Good("dds: { write: deny }").dds.write);
  EXPECT_TRUE(Good("dds: { write: allow }").dds.write);
  EXPECT_TRUE(Good("dds: { domain: 1 }").dds.multicast);
}

TEST(Outputs, DdsSecurityFilesAreRead) {
  const auto here = [](const std::string& path) {
    return (std::filesystem::current_path() / path).lexically_normal().string();
  };
  EXPECT_FALSE(Good("dds: { domain: 1 }").dds.security.on());
  const auto folder = Good("dds: { security: /etc/baudgate/dds }").dds.security;
  EXPECT_EQ(folder.ca, "/etc/baudgate/dds/ca.pem");
  EXPECT_EQ(folder.identity, "/etc/baudgate/dds/identity.pem");
  EXPECT_EQ(folder.key, "/etc/baudgate/dds/key.pem");
  EXPECT_EQ(folder.governance, "/etc/baudgate/dds/governance.p7s");
  EXPECT_EQ(folder.permissions, "/etc/baudgate/dds/permissions.p7s");
  EXPECT_EQ(folder.signer(), folder.ca);
  const auto files = Good(
                         "dds: { security: { ca: c.pem, permissions_ca: /p.pem, identity: i.pem, "
                         "key: ../k.pem, password_file: w, governance: g, permissions: p } }")
                         .dds.security;
  EXPECT_EQ(files.ca, here("c.pem")) << "relative to the configuration, and absolute";
  EXPECT_EQ(files.key, here("../k.pem"));
  EXPECT_EQ(files.password_file, here("w"));
  EXPECT_EQ(files.signer(), "/p.pem");
  EXPECT_EQ(Shown(LoadOutputs("dds: { security: /" + std::string(255, 'x') + " }").problems)
                .substr(0, 40),
            "t.yaml:1:18: error: security: '/xxxxxxxx");
}

TEST(Network, Ipv4IsStoredInItsMappedForm) {
  const auto network = config::ParseNetwork("10.0.0.0/8");
  ASSERT_TRUE(network);
  EXPECT_EQ(network->prefix, 104);
  EXPECT_EQ(network->bytes[10], 0xFF);
  EXPECT_EQ(network->bytes[11], 0xFF);
  EXPECT_EQ(network->bytes[12], 10);
  EXPECT_EQ(config::ParseNetwork("10.1.2.3")->prefix, 128) << "one address is its own range";
  EXPECT_EQ(config::ParseNetwork("fe80::/10")->prefix, 10);
}

config::Loaded LoadWeb(const std::string& web) {
  return config::LoadText("web: " + web +
                              "\nlines: [{ name: l, port: /dev/l, protocol: fake, devices: [{ "
                              "name: d, address: 1, profile: relay }] }]\n",
                          "t.yaml", FakeCatalog());
}

TEST(WebConfig, IsOffByDefault) {
  EXPECT_FALSE(config::Config().web.on);
  const config::Web web = LoadWeb("{}").config.web;
  EXPECT_TRUE(web.on);
  EXPECT_EQ(web.Address(), "127.0.0.1:8502");
  EXPECT_TRUE(web.allow.empty());
  EXPECT_FALSE(web.acknowledge);
}

TEST(WebConfig, IsReadWithAllItsKeys) {
  const config::Loaded loaded = LoadWeb(
      "{ listen: 0.0.0.0:80, allow: [10.0.0.0/8, 192.0.2.7], hosts: [Gate.example, "
      "'proxy:8443'], token: { file: /etc/web.token }, acknowledge: allow }");
  EXPECT_EQ(Shown(loaded.problems), "");
  const config::Web& web = loaded.config.web;
  EXPECT_EQ(web.Address(), "0.0.0.0:80");
  EXPECT_EQ(web.allow.size(), 2U);
  EXPECT_EQ(web.hosts, (std::vector<std::string>{"gate.example", "proxy:8443"}));
  EXPECT_EQ(web.token_file, "/etc/web.token");
  EXPECT_TRUE(web.acknowledge);
  EXPECT_FALSE(web.on_loopback());
  EXPECT_TRUE(LoadWeb("{ listen: localhost:1, proxies: [], hosts: [] }").config.web.on_loopback());
}

using config::PortServer;

config::Loaded LoadLine(const std::string& keys, const std::string& rest = "") {
  return config::LoadText(rest + "lines: [{ name: l, port: /dev/l, " + keys + " }]\n", "t.yaml",
                          FakeCatalog());
}
constexpr const char* kPolled =
    "protocol: fake, devices: [{ name: d, address: 1, profile: relay }], ";

TEST(PortServerConfig, AServedLineNeedsNoProtocol) {
  const auto loaded = LoadLine(
      "serial: 9600 8M2, serial_server: { at: \"127.0.0.1:4001\", mode: rfc2217, allow: [], busy: "
      "wait, idle: 90s }");
  EXPECT_EQ(Shown(loaded.problems), "");
  const config::Line& line = loaded.config.lines.at(0);
  EXPECT_EQ(line.serial.ToString(), "9600 8M2");
  EXPECT_EQ(line.protocol, "");
  const PortServer& server = line.serial_server.value();
  EXPECT_EQ(line.server(), &server);
  EXPECT_EQ(server.Address(), "127.0.0.1:4001");
  EXPECT_EQ(server.mode, PortServer::Mode::rfc2217);
  EXPECT_EQ(server.busy, PortServer::Busy::wait);
  EXPECT_EQ(server.idle, 90s);
}

TEST(PortServerConfig, APolledLineMayLendItsPort) {
  const auto loaded = LoadLine(std::string(kPolled) + "lend: { at: \"[::1]:4001\", for: 5min }");
  EXPECT_EQ(Shown(loaded.problems), "");
  const PortServer& server = loaded.config.lines.at(0).lend.value();
  EXPECT_EQ(server.Address(), "[::1]:4001");
  EXPECT_EQ(server.mode, PortServer::Mode::raw);
  EXPECT_EQ(server.time, 5min);
  EXPECT_EQ(server.idle, 10min);
}

constexpr const char* kSecure =
    "at: \"0.0.0.0:802\", protocol: tls, certificate: /c.pem, key: /c.key, ca: /ca.pem";

TEST(SecureListeners, TheRolesOfUsersHaveRightsByDefault) {
  const Listener listener = ListenerOf(kSecure);
  EXPECT_EQ(listener.protocol, Listener::Protocol::tls);
  EXPECT_EQ(listener.tls, (config::TlsFiles{"/c.pem", "/c.key", "/ca.pem"}));
  EXPECT_EQ(listener.roles, (std::vector<config::RoleRights>{{"viewer", Permit::read, {}},
                                                             {"operator", Permit::all, {}},
                                                             {"engineer", Permit::all, {}}}));
}

TEST(SecureListeners, RolesAreWordsOrListsOfRules) {
  const Listener listener =
      ListenerOf(std::string(kSecure) +
                 ", roles: { viewer: read, boss: write, pump: [{ units: [7, 9-12], functions: 3 }, "
                 "{ addresses: 100-119 }] }");
  EXPECT_EQ(listener.roles,
            (std::vector<config::RoleRights>{
                {"viewer", Permit::read, {}},
                {"boss", Permit::all, {}},
                {"pump", Permit::read, {{{{7, 7}, {9, 12}}, {3}, {}}, {{}, {}, {{100, 119}}}}}}));
}

TEST(SecureListeners, WrongKeysAreErrors) {
  const auto problem = [](const std::string& keys) { return Shown(LoadListener(keys).problems); };
  const std::string secure = kSecure;
  EXPECT_THAT(problem("at: \"0.0.0.0:802\", protocol: tls"),
              ::testing::AllOf(HasSubstr("needs 'certificate'"), HasSubstr("needs 'key'"),
                               HasSubstr("needs 'ca'")));
  EXPECT_THAT(problem("at: \"127.0.0.1:802\", certificate: /c.pem, roles: { viewer: read }"),
              ::testing::AllOf(HasSubstr("certificate: applies only to a listener with TLS"),
                               HasSubstr("roles: applies only to a listener with TLS")));
  EXPECT_THAT(problem(secure + ", framing: rtu"), HasSubstr("framing: Modbus/TCP Security"));
  EXPECT_THAT(problem(secure + ", roles: {}"), HasSubstr("roles: no role has rights"));
  EXPECT_THAT(problem(secure + ", roles: { viewer: all }"), HasSubstr("viewer"));
  EXPECT_THAT(problem(secure + ", roles: { viewer: [] }"), HasSubstr("permits nothing"));
  EXPECT_THAT(problem(secure + ", roles: { viewer: [{}] }"), HasSubstr("an empty rule"));
  EXPECT_THAT(problem(secure + ", roles: { v: [{ units: 256 }] }"), HasSubstr("0…255"));
  EXPECT_THAT(problem(secure + ", roles: { v: [{ addresses: 9-8 }] }"), HasSubstr("0…65535"));
  EXPECT_THAT(problem(secure + ", roles: { v: [{ unit: 7 }] }"), HasSubstr("unit"));
  EXPECT_THAT(problem("at: \"127.0.0.1:802\", protocol: tls, certificate: c.pem, key: /c.key, "
                      "ca: /ca.pem"),
              HasSubstr("not an absolute path"));
  EXPECT_THAT(problem("at: /dev/ttyS9, protocol: tls"), HasSubstr("serial port"));
}

}  // namespace
}  // namespace baudgate::testing
