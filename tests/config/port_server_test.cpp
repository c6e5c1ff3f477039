// The keys serial_server and lend of a line.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/lines.h"
#include "config/loader.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::PortServer;
using ::testing::HasSubstr;

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

TEST(PortServerConfig, APolledLineIsLent) {
  const auto loaded = LoadLine(std::string(kPolled) + "lend: { at: \"[::1]:4001\", for: 5min }");
  EXPECT_EQ(Shown(loaded.problems), "");
  const PortServer& server = loaded.config.lines.at(0).lend.value();
  EXPECT_EQ(server.Address(), "[::1]:4001");
  EXPECT_EQ(server.mode, PortServer::Mode::raw);
  EXPECT_EQ(server.time, 5min);
  EXPECT_EQ(server.idle, 10min);
}

}  // namespace
}  // namespace baudgate::testing
