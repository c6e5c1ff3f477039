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
  EXPECT_EQ(Shown(LoadOutputs("dds: { security: /" + std::string(255, 'x') + " }").problems)
                .substr(0, 40),
            "t.yaml:1:18: error: security: '/xxxxxxxx");
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
