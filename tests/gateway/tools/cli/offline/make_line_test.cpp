// Lines out of profiles and words of the command line: complete as from a file, and as well
// checked.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/make_line.h"

#include <gtest/gtest.h>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

Result<config::Line> Make(const WantedDevice& device, const std::string& protocol = "fake",
                          const std::string& serial = "") {
  return MakeLine({.protocol = protocol, .serial = serial, .devices = {device}}, FakeCatalog());
}

std::string ErrorOf(const Result<config::Line>& line) { return line ? "none" : line.error(); }

TEST(MakeLine, IsTheLineThatAFileWouldGive) {
  const auto made = Make({.profile = "relay", .address = "5", .set = {"mode=careful"}});
  ASSERT_TRUE(made) << made.error();
  const auto loaded = Load(
      "lines:\n- { name: line, port: /dev/null, protocol: fake, devices: [{ name: device, "
      "address: 5, profile: relay, mode: careful }] }\n");
  ASSERT_EQ(Shown(loaded.problems), "");
  const config::Line& configured = loaded.config.lines.at(0);
  EXPECT_EQ(made->name, configured.name);
  EXPECT_EQ(made->port, configured.port);
  EXPECT_EQ(made->protocol, configured.protocol);
  EXPECT_EQ(made->serial.ToString(), configured.serial.ToString());
  EXPECT_EQ(made->options.all(), configured.options.all());
  const config::Device& device = made->devices.at(0);
  const config::Device& same = configured.devices.at(0);
  EXPECT_EQ(device.name, same.name);
  EXPECT_EQ(device.address, same.address);
  EXPECT_EQ(device.title, same.title);
  EXPECT_EQ(device.poll, same.poll);
  EXPECT_EQ(device.word_order, same.word_order);
  EXPECT_EQ(device.options.all(), same.options.all());
  EXPECT_EQ(device.options.Text("mode"), "careful");
  EXPECT_EQ(device.points.size(), same.points.size());
}

TEST(MakeLine, TakesTheProtocolOfTheProfileAndTheSerialSettingsOfTheProtocol) {
  const auto made = Make({.profile = "relay", .address = "5"}, "");
  ASSERT_TRUE(made) << made.error();
  EXPECT_EQ(made->protocol, "fake");
  EXPECT_EQ(made->serial.ToString(), "19200 8E1");
  const auto slow = Make({.profile = "relay", .address = "5"}, "fake", "9600 7E1");
  ASSERT_TRUE(slow) << slow.error();
  EXPECT_EQ(slow->serial.ToString(), "9600 7E1");
}

TEST(MakeLine, SaysAllThatIsWrong) {
  EXPECT_EQ(
      ErrorOf(Make({.address = "100", .set = {"widht=7", "mode=fats", "width"}}, "fake", "9600")),
      "serial: '9600' is not speed and character form; write for example 9600 8N1\n"
      "--set: unknown key 'widht'; did you mean 'width'? allowed: checksum, width, ratio, "
      "mode, password, pin, pause, tags\n"
      "--set: mode: 'fats' is unknown; did you mean 'fast'? allowed: fast, slow, careful\n"
      "--set: write key=value\n"
      "address: '100' is no address; allowed: 1…99");
  EXPECT_EQ(ErrorOf(Make({.address = "1", .set = {"mode=slow", "width=20"}})),
            "device 'device': mode slow has no room for width 20");
}

TEST(MakeLine, NamesWhatIsNotInstalled) {
  EXPECT_EQ(ErrorOf(Make({.address = "1"}, "fakes")),
            "protocol: 'fakes' is not installed; did you mean 'fake'? installed: fake, other");
  EXPECT_EQ(ErrorOf(Make({.profile = "relai", .address = "1"}, "")),
            "no profile named 'relai'; `baudgate profiles` lists them");
  EXPECT_EQ(ErrorOf(Make({.profile = "./relay.yaml", .address = "1"}, "")),
            "a profile given by its path needs --protocol");
}

TEST(MakeLine, AProblemOfAProfileNamesItsPlace) {
  const std::string error = ErrorOf(Make({.profile = "broken", .address = "1"}));
  EXPECT_EQ(error.find("tests/config/profiles/fake/broken.yaml:3:22: point 'a': read 'X1'"), 0U)
      << error;
}

TEST(MakeLine, NeverShowsASecret) {
  for (const char* setting : {"passwordSECRET", "password:SECRET=1", "pin=SECRET"}) {
    const std::string error = ErrorOf(Make({.address = "1", .set = {setting}}));
    EXPECT_NE(error, "none") << setting;
    EXPECT_EQ(error.find("SECRET"), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace baudgate::testing
