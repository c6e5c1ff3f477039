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

struct Wrong {
  std::string keys;
  const char* sentence;
};

TEST(PortServerConfig, SaysWhatIsWrong) {
  const std::string polled = kPolled;
  const Wrong kWrong[] = {
      {"serial_server: {}", "serial_server needs 'at'; for example at: \"127.0.0.1:4001\""},
      {"serial_server: { at: here }",
       "at: 'here' is not host:port; write for example 127.0.0.1:4001"},
      {"serial_server: { at: \"127.0.0.1:70000\" }",
       "at: '127.0.0.1:70000' has no usable port number; allowed: 1…65535"},
      {"lend: { at: \"127.0.0.1:4001\" }",
       "lend: nobody polls this port, so it is not lent; write "
       "serial_server in its place"},
      {"serial_server: { at: \"gate:4001\" }", "'gate' is not an address of this machine"},
      {"serial_server: { at: \"0.0.0.0:4001\" }",
       "serial_server: 0.0.0.0:4001 can be reached from other machines; say who may come in"},
      {polled + "lend: { at: \"10.0.0.7:4001\", allow: [] }",
       "lend: 10.0.0.7:4001 can be reached from other machines; say who may come in"},
      {polled + "lend: { at: \"10.0.0.7:4001\", allow: [10.0.0.8] }",
       "warning: lend: whoever `allow` lets in at 10.0.0.7:4001 speaks to the devices at this port "
       "as it likes: no `write: deny`"},
      {polled + "lend: { at: \"127.0.0.1:4001\", busy: wait }", "unknown key 'busy' in lend"},
      {polled + "serial_server: { at: \"127.0.0.1:4001\" }",
       "serial_server: the gateway asks the devices of this line; write lend in its place"},
      {"serial_server: { at: \"127.0.0.1:4001\" }, lend: { at: \"127.0.0.1:4002\" }",
       "lend: the port is served all the time"},
      {"protocol: fake, serial_server: { at: \"127.0.0.1:4001\" }",
       "warning: protocol: has no effect"},
      {"serial_server: { at: \"127.0.0.1:4001\" } }, { name: m, port: /dev/m, serial_server: { at: "
       "\"127.0.0.1:4001\" }",
       "serial_server: 127.0.0.1:4001 stands twice"},
      {"serial: { rtscts: true, xonxoff: true }, serial_server: { at: \"127.0.0.1:4001\" }",
       "xonxoff: the port has one flow control"},
  };
  for (const Wrong& wrong : kWrong) {
    EXPECT_THAT(Shown(LoadLine(wrong.keys).problems), HasSubstr(wrong.sentence)) << wrong.keys;
  }
}

}  // namespace
}  // namespace baudgate::testing
