// The sections gateway, modbus and dds: forms of listeners and networks, and what is refused.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>

#include "config/loader.h"
#include "config/model/network.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

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
  EXPECT_EQ(Shown(LoadOutputs("gateway: { recordings: here, socket: \"\" }").problems),
            "t.yaml:1:24: error: recordings: 'here' is not an absolute path; write for example "
            "/var/lib/baudgate/recordings\n"
            "t.yaml:1:38: error: socket: '' is not an absolute path; write for example "
            "/run/baudgate/gate.sock\n");
  EXPECT_EQ(Shown(LoadOutputs("gateway: { socket: /" + std::string(107, 'x') + " }").problems),
            "t.yaml:1:20: error: socket: the path is too long; at most 107 bytes\n");
  EXPECT_TRUE(LoadOutputs("gateway: { socket: /" + std::string(106, 'x') + " }").ok());
}

TEST(Outputs, ListenAsTextMapAndList) {
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

TEST(Outputs, SwitchedOff) {
  const auto config = Good("modbus: { enabled: false }\ndds: { enabled: no }");
  EXPECT_FALSE(config.modbus.enabled);
  EXPECT_FALSE(config.dds.enabled);
}

TEST(Outputs, DdsKeys) {
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

TEST(Outputs, DdsSecurity) {
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
  EXPECT_EQ(Shown(LoadOutputs("dds: { security: { ca: c, identity: i, governance: g, permissions: "
                              "p, cert: x } }")
                      .problems),
            "t.yaml:1:18: error: security needs 'key'; for example key: /etc/baudgate/dds/key.pem\n"
            "t.yaml:1:71: error: unknown key 'cert' in security; allowed: ca, permissions_ca, "
            "identity, key, password_file, governance, permissions\n");
  EXPECT_EQ(Shown(LoadOutputs("dds: { security: /" + std::string(255, 'x') + " }").problems)
                .substr(0, 40),
            "t.yaml:1:18: error: security: '/xxxxxxxx");
}

TEST(Outputs, OneSentenceEach) {
  const struct {
    const char* text;
    const char* problem;
  } kCases[] = {
      {"gateway: { name: \"\" }",
       "18: error: name: '' is no name; use letters, digits and single '-' or '_' between them"},
      {"modbus: { listen: \"127.0.0.1:99999\" }",
       "19: error: listen: '127.0.0.1:99999' has no usable port number; allowed: 1…65535"},
      {"modbus: { listen: \"gate:502\" }",
       "19: error: listen: 'gate' is not an address of this machine; write an IP address, 0.0.0.0 "
       "for all"},
      {"modbus: { listen: [] }",
       "19: error: listen: the list is empty; to serve nothing on Modbus write modbus: { enabled: "
       "false }"},
      {"modbus: { listen: { allow: [10.0.0.1/8] } }",
       "29: error: allow: '10.0.0.1/8' has bits beyond its prefix; write 10.0.0.0/8"},
      {"modbus: { listen: { allow: [10.0.0.0/33] } }",
       "29: error: allow: '10.0.0.0/33' has no usable prefix; allowed: /0…/32"},
      {"modbus: { listen: { allow: [home] } }",
       "29: error: allow: 'home' is not an address range; write for example 10.0.0.0/8"},
      {"modbus: { listen: { allow: [] } }",
       "28: error: allow: an empty list would let nobody in; leave the key out to allow everybody"},
      {"modbus: { listen: { write: no } }",
       "28: error: write: 'no' is unknown; allowed: allow, deny"},
      {"dds: { write: yes }", "15: error: write: 'yes' is unknown; allowed: deny, allow"},
      {"modbus: { listen: [\"127.0.0.1:1\", \"localhost:1\"] }",
       "35: error: listen: 127.0.0.1:1 stands twice; first in line 1"},
      {"modbus: { listen: { at: \"0.0.0.0:502\", allow: [127.0.0.0/8, \"::1\"] } }",
       "19: warning: listen: 0.0.0.0 takes connections from everywhere, but 'allow' has only "
       "loopback; write 127.0.0.1 or allow the masters' network"},
      {"dds: { interfaces: [eth0] }",
       "21: error: interfaces: 'eth0' is not an IP address; write for example 127.0.0.1"},
      {"dds: { interfaces: [] }",
       "20: error: interfaces: the list is empty: nobody could be reached; write [127.0.0.1]"},
      {"dds: { peers: [plant] }",
       "16: error: peers: 'plant' is not the IPv4 address of a machine; write for example "
       "10.0.0.7"},
      {"dds: { peers: [239.255.0.1] }",
       "16: error: peers: '239.255.0.1' is not the IPv4 address of a machine; write for example "
       "10.0.0.7"},
      {"dds: { peers: [127.0.0.2, 127.0.0.2] }",
       "27: warning: peers: 127.0.0.2 stands there already"},
      {"dds: { discovery_servers: [\"255.255.255.255:11811\"] }",
       "28: error: discovery_servers: '255.255.255.255:11811' is not the IPv4 address and port of "
       "a server; write for example 10.0.0.7:11811"},
      {"dds: { peers: [10.0.0.7] }",
       "16: warning: peers: 10.0.0.7 is not reached from interfaces, which has only loopback; add "
       "this machine's address in that network"},
      {"dds: { discovery_servers: [127.0.0.1] }",
       "28: error: discovery_servers: '127.0.0.1' has no port; write for example 127.0.0.1:11811"},
      {"dds: { discovery_servers: [\":11811\"] }",
       "28: error: discovery_servers: ':11811' has no address; write for example 10.0.0.7:11811"},
      {"dds: { discovery_servers: [\"127.0.0.1:0\"] }",
       "28: error: discovery_servers: '127.0.0.1:0' has no usable port number; allowed: 1…65535"},
      {"dds: { discovery_servers: [\"plant:11811\"] }",
       "28: error: discovery_servers: 'plant:11811' is not the IPv4 address and port of a server; "
       "write for example 10.0.0.7:11811 (names are not looked up)"},
      {"dds: { discovery_servers: [\"[::1]:11811\"] }",
       "28: error: discovery_servers: '[::1]:11811' is not the IPv4 address and port of a server; "
       "write for example 10.0.0.7:11811"},
      {"dds: { discovery_servers: [\"0.0.0.0:11811\"] }",
       "28: error: discovery_servers: '0.0.0.0:11811' is not the address of one machine"},
      {"dds: { discovery_servers: [\"10.0.0.7:11811\"] }",
       "28: warning: discovery_servers: 10.0.0.7 is not reached from interfaces, which has only "
       "loopback; add this machine's address in that network"},
      {"dds: { multicast: false }",
       "19: warning: multicast: off, and there are neither peers nor discovery_servers: only "
       "participants that ask this gateway find it"},
      {"dds: { domain: 102 }",
       "16: warning: domain: its UDP port 32900 is one of those that Linux gives to any program "
       "(32768 to 60999); while another one has it, no new subscriber is heard; choose a domain up "
       "to 101, or reserve the port: sysctl -w net.ipv4.ip_local_reserved_ports=32900"},
      {"dds: { lease: 1s }", "15: error: lease: '1s' is out of range; allowed: 2s…1min"},
      {"dds: { heartbeat: 10 }",
       "19: error: heartbeat: '10' has no unit; write for example 10ms or 10s"},
  };
  for (const auto& one : kCases) {
    EXPECT_EQ(Shown(LoadOutputs(one.text).problems), "t.yaml:1:" + std::string(one.problem) + "\n")
        << one.text;
  }
}

TEST(Network, Ipv4IsHeldInItsMappedForm) {
  const auto network = config::ParseNetwork("10.0.0.0/8");
  ASSERT_TRUE(network);
  EXPECT_EQ(network->prefix, 104);
  EXPECT_EQ(network->bytes[10], 0xFF);
  EXPECT_EQ(network->bytes[11], 0xFF);
  EXPECT_EQ(network->bytes[12], 10);
  EXPECT_EQ(config::ParseNetwork("10.1.2.3")->prefix, 128) << "one address is its own range";
  EXPECT_EQ(config::ParseNetwork("fe80::/10")->prefix, 10);
}

}  // namespace
}  // namespace baudgate::testing
