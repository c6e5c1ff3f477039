// What a good configuration comes to: defaults, precedence of device over profile over protocol,
// options, serial settings.
// SPDX-License-Identifier: Apache-2.0
#include "config/loader.h"

#include <gtest/gtest.h>

#include "config/catalog/option_values.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using config::Device;
using config::Line;
using config::Loaded;

constexpr const char* kRelay =
    "lines:\n"
    "- name: l\n"
    "  port: /dev/l\n"
    "  protocol: fake\n"
    "  devices:\n"
    "  - { name: d, address: 1, profile: relay }\n";

Line OneLine(const std::string& keys) {
  const Loaded loaded =
      Load("lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [], " + keys + " }\n");
  EXPECT_TRUE(loaded.ok()) << Shown(loaded.problems);
  return loaded.config.lines.empty() ? Line() : loaded.config.lines[0];
}

Device OneDevice(const std::string& keys) {
  const Loaded loaded =
      Load("lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [{ name: d, address: 1, " +
           keys + " }] }\n");
  EXPECT_TRUE(loaded.ok()) << Shown(loaded.problems);
  if (loaded.config.lines.empty() || loaded.config.lines[0].devices.empty()) return {};
  return loaded.config.lines[0].devices[0];
}

TEST(Loader, GivesDefaultsWhereNothingIsSaid) {
  const Loaded loaded = Load(kRelay);
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(loaded.config.name, "baudgate");
  ASSERT_EQ(loaded.config.modbus.listen.size(), 1U);
  EXPECT_EQ(loaded.config.modbus.listen[0].host, "127.0.0.1");
  EXPECT_EQ(loaded.config.modbus.listen[0].port, 1502);
  EXPECT_TRUE(loaded.config.dds.enabled);
  const Line& line = loaded.config.lines.at(0);
  EXPECT_EQ(line.serial.ToString(), "19200 8E1") << "the protocol's own";
  EXPECT_EQ(line.retries, 2);
  EXPECT_EQ(line.echo, config::Echo::off);
  EXPECT_EQ(line.mark.line, 2);
  EXPECT_EQ(line.devices.at(0).mark.ToString(), "t.yaml:6:5");
}

TEST(Loader, ProfileFillsWhatTheDeviceLeavesOpen) {
  const Device device = OneDevice("profile: relay, unit: 7, poll: 3s, timing: { reply: 900ms }");
  EXPECT_EQ(device.protocol, "fake");
  EXPECT_EQ(device.title, "Fake relay");
  EXPECT_EQ(device.unit, 7);
  EXPECT_EQ(device.poll, 3s) << "device before profile";
  EXPECT_EQ(device.slow, 2min) << "from the profile";
  EXPECT_EQ(device.retries, 5);
  EXPECT_EQ(device.word_order, config::WordOrder::cdab);
  EXPECT_EQ(device.timing.reply, 900ms) << "device before profile";
  EXPECT_EQ(device.timing.gap, 30ms) << "from the profile";
  EXPECT_FALSE(device.timing.quiet);
  ASSERT_EQ(device.points.size(), 3U);
  EXPECT_EQ(*device.points[0].description, "current");
}

TEST(Loader, EveryOptionIsPresentAndTyped) {
  const Device device = OneDevice("profile: relay, width: 3, ratio: 2.5, pause: 1s, tags: [x, y]");
  EXPECT_EQ(device.options.Integer("width"), 3) << "device before profile";
  EXPECT_TRUE(device.options.Flag("checksum")) << "profile before fallback";
  EXPECT_EQ(device.options.Real("ratio"), 2.5);
  EXPECT_EQ(device.options.Text("mode"), "fast") << "fallback";
  EXPECT_EQ(device.options.Text("password"), "000000");
  EXPECT_EQ(device.options.Time("pause"), 1s);
  EXPECT_EQ(device.options.Texts("tags"), (std::vector<std::string>{"x", "y"}));
  EXPECT_TRUE(device.options.Flag("broadcast")) << "of the line, for its devices to see";
}

TEST(Loader, LineOptionsReachTheDevices) {
  const Loaded loaded = Load(
      "lines:\n"
      "- { name: l, port: /dev/l, protocol: fake, broadcast: false,\n"
      "    devices: [{ name: d, address: 1, profile: relay }] }\n");
  ASSERT_EQ(Shown(loaded.problems), "");
  EXPECT_FALSE(loaded.config.lines[0].options.Flag("broadcast"));
  EXPECT_EQ(loaded.config.lines[0].options.Integer("width"), 7) << "every option has a value";
  EXPECT_FALSE(loaded.config.lines[0].devices[0].options.Flag("broadcast"));
}

TEST(Loader, UnquotedPasswordKeepsItsZeros) {
  EXPECT_EQ(OneDevice("profile: relay, password: 000123").options.Text("password"), "000123");
  EXPECT_EQ(OneDevice("profile: relay, password: no").options.Text("password"), "no");
}

TEST(Loader, DeviceMaySpeakAnotherProtocol) {
  const Device device =
      OneDevice("protocol: other, serial: 300 7O2, points: [{ name: p, read: A1, type: int16 }]");
  EXPECT_EQ(device.protocol, "other");
  ASSERT_TRUE(device.serial);
  EXPECT_EQ(device.serial->ToString(), "300 7O2");
}

TEST(Loader, SerialAsTextAndAsMapAreTheSame) {
  const auto text = OneLine("serial: 9600 7E1, parity: software").serial;
  const auto map =
      OneLine("serial: { baud: 9600, data: 7, parity: even, stop: 1, software_parity: true }")
          .serial;
  for (const auto& serial : {text, map}) {
    EXPECT_EQ(serial.ToString(), "9600 7E1");
    EXPECT_TRUE(serial.software_parity);
    EXPECT_TRUE(serial.low_latency);
    EXPECT_FALSE(serial.rs485.enabled);
  }
}

TEST(Loader, Rs485) {
  const auto serial = OneLine(
                          "serial: 9600 8N1, rs485: { delay_before_send: 2ms, "
                          "receive_while_sending: true, rts_active_high: false }")
                          .serial;
  EXPECT_TRUE(serial.rs485.enabled);
  EXPECT_EQ(serial.rs485.delay_before_send, 2ms);
  EXPECT_TRUE(serial.rs485.receive_while_sending);
  EXPECT_FALSE(serial.rs485.rts_active_high);
}

TEST(Loader, MissingFileIsOneClearProblem) {
  const Loaded loaded = config::LoadFile("/nowhere/gate.yaml", FakeCatalog());
  EXPECT_FALSE(loaded.ok());
  EXPECT_EQ(Shown(loaded.problems),
            "/nowhere/gate.yaml: error: cannot be opened: No such file or directory\n");
  EXPECT_EQ(Shown(config::LoadFile("config", FakeCatalog()).problems),
            "config: error: is a directory, not a file\n");
}

TEST(Loader, ProfileByNameAndByPath) {
  const Protocol protocol = MakeFakeProtocol("fake");
  const auto by_name = config::LoadProfile("relay", protocol, FakeCatalog());
  const auto by_path =
      config::LoadProfile("tests/config/profiles/fake/relay.yaml", protocol, FakeCatalog());
  for (const auto& loaded : {by_name, by_path}) {
    ASSERT_EQ(Shown(loaded.problems), "");
    EXPECT_EQ(loaded.profile.name, "relay");
    EXPECT_EQ(loaded.profile.points.size(), 3U);
    EXPECT_TRUE(loaded.profile.options.Flag("checksum"));
    EXPECT_FALSE(loaded.profile.options.Has("mode")) << "only what the profile sets";
  }
}

TEST(Loader, DeviceFromProfileEqualsTheConfiguredOne) {
  const Protocol protocol = MakeFakeProtocol("fake");
  const auto loaded = config::LoadProfile("relay", protocol, FakeCatalog());
  const Device made = config::DeviceFromProfile(loaded.profile, protocol, "d", "1");
  const Device configured = OneDevice("profile: relay");
  EXPECT_EQ(made.poll, configured.poll);
  EXPECT_EQ(made.word_order, configured.word_order);
  EXPECT_EQ(made.timing.reply, configured.timing.reply);
  EXPECT_EQ(made.options.all(), configured.options.all());
  EXPECT_EQ(made.points.size(), configured.points.size());
}

TEST(Loader, ProblemsOfAProfileNameItsFile) {
  const Protocol protocol = MakeFakeProtocol("fake");
  EXPECT_EQ(Shown(config::LoadProfile("broken", protocol, FakeCatalog()).problems),
            "tests/config/profiles/fake/broken.yaml:3:22: error: point 'a': read 'X1' is not "
            "understood; write A and a number\n"
            "tests/config/profiles/fake/broken.yaml:4:32: error: type: 'float33' is unknown; did "
            "you mean 'float32'? allowed: bool, int8, uint8, int16, uint16, int32, uint32, int64, "
            "uint64, float32, float64, string(n), or a type of IEC 61131-3 such as REAL\n");
  EXPECT_EQ(Shown(config::LoadProfile("relai", protocol, FakeCatalog()).problems),
            "relai: error: profile 'relai' is not installed for fake; did you mean 'relay'? "
            "installed: broken, relay (searched tests/config/nowhere/fake, "
            "tests/config/profiles/fake)\n");
}

TEST(OptionTable, ReadsTextForEveryKind) {
  const Protocol protocol = MakeFakeProtocol("fake");
  const auto parse = [&](std::string_view name, std::string_view text) {
    for (const OptionSpec& spec : protocol.options) {
      if (spec.name == name) return config::ParseOption(spec, text);
    }
    return Result<config::OptionValue>(Error{"no such option"});
  };
  EXPECT_EQ(std::get<bool>(*parse("checksum", "true")), true);
  EXPECT_EQ(std::get<std::vector<std::string>>(*parse("tags", " x , y ")),
            (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(parse("width", "21").error(), "'21' is out of range; allowed: 1…20");
  EXPECT_EQ(parse("pin", "12345").error(), "the value is out of range; allowed: 0…9999")
      << "a secret is not quoted";
}

}  // namespace
}  // namespace baudgate::testing
