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

}  // namespace
}  // namespace baudgate::testing
