// The key web.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "config/outputs.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

config::Loaded LoadWeb(const std::string& web) {
  return config::LoadText("web: " + web +
                              "\nlines: [{ name: l, port: /dev/l, protocol: fake, devices: [{ "
                              "name: d, address: 1, profile: relay }] }]\n",
                          "t.yaml", FakeCatalog());
}

TEST(WebConfig, IsOffUntilItIsThere) {
  EXPECT_FALSE(config::Config().web.on);
  const config::Web web = LoadWeb("{}").config.web;
  EXPECT_TRUE(web.on);
  EXPECT_EQ(web.Address(), "127.0.0.1:8502");
  EXPECT_TRUE(web.allow.empty());
  EXPECT_FALSE(web.acknowledge);
}

TEST(WebConfig, IsRead) {
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
  EXPECT_TRUE(LoadWeb("{ listen: localhost:1, allow: [], hosts: [] }").config.web.on_loopback());
}

TEST(WebConfig, ErrorsSayWhatToWrite) {
  const struct {
    const char* web;
    const char* problem;
  } kErrors[] = {
      {"{ listen: 8502 }",
       "t.yaml:1:16: error: listen: '8502' is not host:port; write for example 127.0.0.1:8502\n"},
      {"{ listen: 'gate:8502' }",
       "t.yaml:1:16: error: listen: 'gate' is not an address of this machine; write an IP "
       "address, 0.0.0.0 for all\n"},
      {"{ listen: 0.0.0.0:8502 }",
       "t.yaml:1:16: error: listen: 0.0.0.0:8502 can be reached from other machines, and nobody "
       "would have to log in; add token: { file: /etc/baudgate/web.token }, or listen on "
       "127.0.0.1\n"},
      {"{ hosts: ['http://gate'] }",
       "t.yaml:1:16: error: hosts: 'http://gate' is no name of a machine; write for example "
       "gate.example.com, without http://\n"},
      {"{ token: { file: token } }",
       "t.yaml:1:23: error: file: 'token' is not an absolute path; write for example "
       "/etc/baudgate/web.token\n"},
      {"{ acknowledge: yes }",
       "t.yaml:1:21: error: acknowledge: 'yes' is unknown; allowed: deny, allow\n"},
      {"{ port: 80 }",
       "t.yaml:1:8: error: unknown key 'port' in web; allowed: listen, allow, hosts, token, "
       "acknowledge\n"},
  };
  for (const auto& [web, problem] : kErrors) EXPECT_EQ(Shown(LoadWeb(web).problems), problem);
}

}  // namespace
}  // namespace baudgate::testing
