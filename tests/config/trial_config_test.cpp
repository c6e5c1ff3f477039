// Tests TrialConfig, the copy of a configuration that runs without hardware.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "config/copies.h"
#include "config/loader.h"
#include "tests/config/shipped.h"

namespace baudgate::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string TextOf(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

TrialPlaces PlacesFor(std::size_t lines) {
  TrialPlaces places;
  for (std::size_t i = 0; i < lines; ++i) places.ports.push_back("/tmp/t/" + std::to_string(i));
  places.profiles = "/home/me/plant";
  places.state = "/tmp/t/state";
  return places;
}

TEST(TrialConfig, OfEveryExampleLoadsAndUsesNothingOfThePlant) {
  for (const char* name : {"baudgate", "digi-one", "substation"}) {
    const std::string text = TextOf(std::string("config/examples/") + name + ".yaml");
    const Loaded original = LoadText(text, "original.yaml", testing::Shipped());
    ASSERT_TRUE(original.ok()) << name;
    const auto trial = MakeTrialConfig(text, PlacesFor(original.config.lines.size()));
    ASSERT_TRUE(trial) << trial.error();
    const Loaded again = LoadText(trial->yaml, "trial.yaml", testing::Shipped());
    ASSERT_TRUE(again.ok()) << again.problems.front().message << '\n' << trial->yaml;
    const Config& config = again.config;
    EXPECT_EQ(config.name, original.config.name + "-trial");
    EXPECT_EQ(config.state, "/tmp/t/state");
    EXPECT_EQ(config.socket, "");
    for (std::size_t i = 0; i < config.lines.size(); ++i) {
      EXPECT_EQ(config.lines[i].port, "/tmp/t/" + std::to_string(i));
      EXPECT_EQ(config.lines[i].devices.size(), original.config.lines[i].devices.size());
      EXPECT_EQ(config.lines[i].serial.ToString(), original.config.lines[i].serial.ToString());
      EXPECT_FALSE(config.lines[i].serial.rs485.enabled);
    }
    for (const Listener& listener : config.modbus.listen) {
      EXPECT_EQ(listener.host, "127.0.0.1");
      EXPECT_GE(listener.port, 1024);
      EXPECT_TRUE(listener.allow.empty()) << "this machine has to be let in";
    }
    for (const Route& route : config.modbus.routes) EXPECT_EQ(route.host, "");
    EXPECT_THAT(config.dds.interfaces, ElementsAre("127.0.0.1"));
  }
}

TEST(TrialConfig, NeedsNoFilesOfTls) {
  const std::string files = "certificate: /c.pem, key: /c.key";
  const auto trial =
      MakeTrialConfig("web: { listen: \"0.0.0.0:8502\", " + files +
                          ", client_ca: /ca.pem }\n"
                          "modbus: { listen: { at: \"0.0.0.0:802\", protocol: tls, " +
                          files +
                          ", ca: /ca.pem, "
                          "roles: { viewer: read } } }\n"
                          "lines:\n"
                          "- { name: a, port: \"tls://10.0.0.5:4001\", ca: /ca.pem, " +
                          files +
                          ", protocol: spabus, "
                          "devices: [{ name: d, address: 1, profile: spaj140c }], "
                          "lend: { at: \"127.0.0.1:4002\", " +
                          files + " } }\n",
                      PlacesFor(1));
  ASSERT_TRUE(trial) << trial.error();
  const Loaded loaded = LoadText(trial->yaml, "trial.yaml", testing::Shipped());
  ASSERT_TRUE(loaded.ok()) << loaded.problems.front().message << '\n' << trial->yaml;
  EXPECT_THAT(TlsUses(loaded.config), ::testing::IsEmpty());
}

TEST(TrialConfig, ListsTheOmittedParts) {
  const auto trial = MakeTrialConfig(
      "modbus:\n"
      "  listen: [ \"0.0.0.0:502\", \"127.0.0.1:1502\", /dev/ttyS1 ]\n"
      "  routes: [ { units: 5, server: 10.0.0.9 }, { units: 6, line: a } ]\n"
      "lines:\n"
      "  - name: a\n"
      "    port: /dev/ttyUSB0\n"
      "    protocol: modbus_rtu\n"
      "    serial: { baud: 9600, rs485: { enabled: true } }\n"
      "    devices: [ { name: d, address: 1, profile: mine/meter.yaml } ]\n"
      "new_output: { broker: 10.0.0.8 }\n",
      PlacesFor(1));
  ASSERT_TRUE(trial) << trial.error();
  EXPECT_THAT(trial->left_out,
              ElementsAre(HasSubstr("/dev/ttyS1"), HasSubstr("10.0.0.9"), HasSubstr("new_output")));
  EXPECT_THAT(trial->yaml, HasSubstr("/home/me/plant/mine/meter.yaml"));
  EXPECT_THAT(trial->yaml, HasSubstr("127.0.0.1:1502"));
  EXPECT_THAT(trial->yaml, HasSubstr("127.0.0.1:1503")) << "each listener has a port of its own";
  EXPECT_THAT(trial->yaml, HasSubstr("baudgate-trial"));
  EXPECT_THAT(trial->yaml, ::testing::Not(HasSubstr("rs485")));
  EXPECT_THAT(trial->yaml, ::testing::Not(HasSubstr("broker"))) << "it may belong to the plant";
}

}  // namespace
}  // namespace baudgate::config
