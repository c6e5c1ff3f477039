// Tests the result of a valid configuration: defaults, precedence, options, serial settings.
// SPDX-License-Identifier: Apache-2.0
#include "config/loader.h"

#include <gtest/gtest.h>

#include <fstream>

#include "config/catalog/catalog.h"
#include "config/catalog/option_values.h"
#include "config/devices.h"
#include "config/profile.h"
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

TEST(Loader, MissingKeysGetTheirDefaults) {
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

TEST(Loader, TheProfileFillsKeysThatTheDeviceOmits) {
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

TEST(Loader, ADeviceMayHaveAnotherProtocolThanItsLine) {
  const Device device =
      OneDevice("protocol: other, serial: 300 7O2, points: [{ name: p, read: A1, type: int16 }]");
  EXPECT_EQ(device.protocol, "other");
  ASSERT_TRUE(device.serial);
  EXPECT_EQ(device.serial->ToString(), "300 7O2");
}

TEST(Loader, SerialSettingsAsTextAndAsMapAreEqual) {
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

TEST(Loader, Rs485SettingsAreRead) {
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
  const protocols::Protocol protocol = MakeFakeProtocol("fake");
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

TEST(Loader, DeviceFromProfileEqualsTheConfiguredDevice) {
  const protocols::Protocol protocol = MakeFakeProtocol("fake");
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
  const protocols::Protocol protocol = MakeFakeProtocol("fake");
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
  const protocols::Protocol protocol = MakeFakeProtocol("fake");
  const auto parse = [&](std::string_view name, std::string_view text) {
    for (const protocols::OptionSpec& spec : protocol.options) {
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

class SharedProfiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    root_ = std::filesystem::path(::testing::TempDir()) / ("shared-profiles-" + name);
    std::filesystem::remove_all(root_);
    Put("owner", "common");
    Put("owner", "both");
    Put("guest", "both");
    guest_.profiles_of = "owner";
    catalog_.protocols = {{"owner", &owner_}, {"guest", &guest_}};
    catalog_.profile_dirs = {root_};
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  void Put(const std::string& protocol, const std::string& profile) {
    std::filesystem::create_directories(root_ / protocol);
    std::ofstream(root_ / protocol / (profile + ".yaml")) << "device: x\npoints: []\n";
  }
  std::string Listed(const std::string& protocol) {
    std::string text;
    for (const auto& file : catalog_.Profiles(protocol)) {
      text += (text.empty() ? "" : " ") + file.protocol + "/" + file.name;
    }
    return text;
  }

  std::filesystem::path root_;
  protocols::Protocol owner_ = MakeFakeProtocol("owner");
  protocols::Protocol guest_ = MakeFakeProtocol("guest");
  config::Catalog catalog_;
};

TEST_F(SharedProfiles, AreFoundByName) {
  EXPECT_EQ(catalog_.FindProfile("guest", "common"), root_ / "owner" / "common.yaml");
  EXPECT_EQ(catalog_.FindProfile("guest", "both"), root_ / "guest" / "both.yaml") << "its own";
  EXPECT_EQ(catalog_.FindProfile("owner", "both"), root_ / "owner" / "both.yaml");
  EXPECT_FALSE(catalog_.FindProfile("guest", "none").has_value());
  Put("guest", "own");
  EXPECT_FALSE(catalog_.FindProfile("owner", "own").has_value()) << "not the other way round";
}

TEST_F(SharedProfiles, AreListedOnce) {
  EXPECT_EQ(Listed("guest"), "guest/both owner/common");
  EXPECT_EQ(Listed("owner"), "owner/both owner/common");
  EXPECT_EQ(Listed(""), "guest/both owner/both owner/common");
}

TEST_F(SharedProfiles, AreSuggestedForAMisspeltProfile) {
  const auto missed = config::LocateProfile("comon", guest_, catalog_, {});
  ASSERT_FALSE(missed);
  EXPECT_NE(missed.error().find("common"), std::string::npos) << missed.error();
  EXPECT_NE(missed.error().find((root_ / "guest").string()), std::string::npos);
  EXPECT_NE(missed.error().find((root_ / "owner").string()), std::string::npos);
}

// ---------------- Precedence of times, retries and periods, for each key separately: protocol's
// default < gateway < line < profile < device.

using config::Timing;

/// The device uses the profile `relay`: reply 700ms, gap 30ms, retries 5, poll 2s, slow 2min.
config::Line LineOf(const std::string& gateway, const std::string& line,
                    const std::string& device) {
  const config::Loaded loaded = Load("lines:\n- { name: l, port: /dev/l, protocol: fake, " + line +
                                     " devices: [{ name: d, address: 1, " + device +
                                     " }] }\n"
                                     "gateway: { name: g" +
                                     gateway + " }\n");
  EXPECT_TRUE(loaded.ok()) << Shown(loaded.problems);
  return loaded.config.lines.empty() ? config::Line() : loaded.config.lines[0];
}

constexpr const char* kPlain = "points: [{ name: p, read: A1, type: int16 }]";
constexpr const char* kProfiled = "profile: relay";

TEST(Pace, HasDefaultsWhenNoLevelSetsIt) {
  const config::Line line = LineOf("", "", kPlain);
  EXPECT_EQ(line.retries, 2);
  EXPECT_FALSE(line.devices[0].retries);
  EXPECT_EQ(line.devices[0].poll, 1s);
  EXPECT_EQ(line.devices[0].slow, 1min);
  EXPECT_EQ(line.devices[0].daily, 24h);
  EXPECT_FALSE(line.timing.reply);
}

TEST(Pace, AMoreSpecificLevelOverridesTheOthers) {
  const std::string gateway = ", poll: 11s, slow: 12min, daily: 6h, retries: 7";
  const std::string line = "poll: 13s, slow: 14min, retries: 8,";
  const std::string device = ", poll: 15s, slow: 16min, daily: 7h, retries: 9";

  const config::Line by_gateway = LineOf(gateway, "", kPlain);
  EXPECT_EQ(by_gateway.devices[0].poll, 11s);
  EXPECT_EQ(by_gateway.devices[0].slow, 12min);
  EXPECT_EQ(by_gateway.devices[0].daily, 6h);
  EXPECT_EQ(by_gateway.retries, 7);

  const config::Line by_line = LineOf(gateway, line, kPlain);
  EXPECT_EQ(by_line.devices[0].poll, 13s);
  EXPECT_EQ(by_line.devices[0].slow, 14min);
  EXPECT_EQ(by_line.retries, 8);
  EXPECT_FALSE(by_line.devices[0].retries) << "the line's";

  const config::Line by_profile = LineOf(gateway, line, kProfiled);
  EXPECT_EQ(by_profile.devices[0].poll, 2s);
  EXPECT_EQ(by_profile.devices[0].slow, 2min);
  EXPECT_EQ(by_profile.devices[0].retries, 5);

  const config::Line by_device = LineOf(gateway, line, kProfiled + device);
  EXPECT_EQ(by_device.devices[0].poll, 15s);
  EXPECT_EQ(by_device.devices[0].slow, 16min);
  EXPECT_EQ(by_device.devices[0].daily, 7h);
  EXPECT_EQ(by_device.devices[0].retries, 9);
}

TEST(Pace, EachTimeIsOverriddenByItself) {
  const config::Line line =
      LineOf(", timing: { quiet: 1ms, reply: 2s, gap: 31ms, drain: 41ms, ceiling: 9s }",
             "timing: { gap: 32ms, drain: 42ms, reply: 3s },",
             std::string(kProfiled) + ", timing: { drain: 43ms }");
  EXPECT_EQ(line.timing.quiet, 1ms) << "gateway";
  EXPECT_EQ(line.timing.gap, 32ms) << "line before gateway";
  const Timing used = Merge(line.devices[0].timing, line.timing);
  EXPECT_EQ(used.quiet, 1ms) << "gateway";
  EXPECT_EQ(used.ceiling, 9s) << "gateway";
  EXPECT_EQ(used.reply, 3s) << "the line's, longer than the profile's";
  EXPECT_EQ(used.gap, 32ms) << "likewise";
  EXPECT_EQ(used.drain, 43ms) << "device before line";
}

TEST(Pace, EachLevelChecksItsKeys) {
  for (const char* const keys : {"poll: 1ms", "slow: 25h", "retries: 11", "timing: { reply: 0s }",
                                 "timing: { replay: 1s }", "timing: { ceiling: 1s, reply: 2s }"}) {
    EXPECT_FALSE(Load("gateway: { " + std::string(keys) + " }\nlines: []\n").ok()) << keys;
    EXPECT_FALSE(Load("lines: [{ name: l, port: /dev/l, protocol: fake, devices: [], " +
                      std::string(keys) + " }]\n")
                     .ok())
        << keys;
  }
}

Duration CeilingUsed(std::optional<Duration> reply, std::optional<Duration> ceiling) {
  const Timing fallback = {
      .quiet = 5ms, .reply = 500ms, .gap = 25ms, .ceiling = 2s, .drain = 100ms};
  Timing given;
  given.reply = reply;
  given.ceiling = ceiling;
  return *config::Resolve(given, fallback).ceiling;
}

TEST(Resolve, ALongerReplyTimeLengthensTheCeiling) {
  EXPECT_EQ(CeilingUsed({}, {}), 2s);
  EXPECT_EQ(CeilingUsed(1500ms, {}), 3s);
  EXPECT_EQ(CeilingUsed(300ms, {}), 1800ms);
  EXPECT_EQ(CeilingUsed(1500ms, 4s), 4s);
  EXPECT_EQ(CeilingUsed(1500ms, 1s), 1525ms) << "never shorter than reply and gap";
}

TEST(Resolve, LongerPausesLengthenTheCeiling) {
  Timing fallback;
  fallback.reply = 500ms;
  fallback.gap = 50ms;
  fallback.ceiling = 750ms;
  const auto ceiling = [&](Duration gap, std::optional<Duration> own = {}) {
    Timing given;
    given.gap = gap;
    given.ceiling = own;
    return *config::Resolve(given, fallback).ceiling;
  };
  EXPECT_EQ(ceiling(200ms), 750ms + 16 * 150ms);
  EXPECT_EQ(ceiling(2s), 5750ms) << "at most 5 s more";
  EXPECT_EQ(ceiling(20ms), 750ms);
  EXPECT_EQ(ceiling(200ms, 900ms), 900ms);
}

TEST(Pace, TheLongerReplyGapAndCeilingOfLineAndProfileApply) {
  const auto timing = [](const std::string& line, const std::string& device) {
    return LineOf("", "timing: { " + line + " },", kProfiled + device).devices[0].timing;
  };
  const Timing longer = timing("reply: 2s, gap: 10ms, quiet: 9ms", "");
  EXPECT_EQ(longer.reply, 2s) << "the line's: its user knows what is between";
  EXPECT_EQ(longer.from[1], config::Level::line);
  EXPECT_EQ(longer.gap, 30ms) << "the profile's: the device needs it";
  EXPECT_EQ(longer.from[2], config::Level::profile);
  EXPECT_EQ(timing("reply: 2s", ", timing: { reply: 100ms }").reply, 100ms) << "the device's own";
}

TEST(Pace, AWarningNamesKeysThatAProfileOverrides) {
  const auto loaded = Load(
      "lines: [{ name: l, port: /dev/l, protocol: fake, poll: 5s, timing: { reply: 500ms, quiet: "
      "1ms }, devices: [{ name: d, address: 1, profile: relay }] }]\n");
  EXPECT_EQ(Shown(loaded.problems),
            "t.yaml:1:108: warning: device 'd': poll 5s of the line or gateway has no effect, "
            "because the device's profile sets 2s; set the key at the device to override the "
            "profile\nt.yaml:1:108: warning: device 'd': timing.reply 500ms of the line has no "
            "effect, because the device's profile sets 700ms, which is longer; set the key at the "
            "device to override the profile\n");
}

TEST(Pace, RecheckFollowsTheMostSpecificLevel) {
  const auto recheck = [](const std::string& gateway, const std::string& line,
                          const std::string& device, const std::string& point) {
    return LineOf(gateway, line,
                  "points: [{ name: p, read: A1, type: int16" + point + " }]" + device)
        .devices[0]
        .points[0]
        .recheck;
  };
  using config::Recheck;
  EXPECT_EQ(recheck("", "", "", ""), Recheck::off) << "the fake's check value is strong";
  EXPECT_EQ(recheck(", recheck: jump", "", "", ""), Recheck::jump);
  EXPECT_EQ(recheck(", recheck: jump", "recheck: always,", "", ""), Recheck::always);
  EXPECT_EQ(recheck("", "recheck: always,", ", recheck: off", ""), Recheck::off);
  EXPECT_EQ(recheck("", "", ", recheck: off", ", recheck: jump"), Recheck::jump);
}

TEST(Pace, RecheckIsOnWithoutParityAndWithAWeakChecksum) {
  protocols::Protocol weak;
  weak.weak_check = true;
  EXPECT_EQ(config::DefaultRecheck(weak, {.parity = config::Parity::none}), config::Recheck::jump);
  EXPECT_EQ(config::DefaultRecheck(weak, {.parity = config::Parity::even}), config::Recheck::off);
  EXPECT_EQ(config::DefaultRecheck({}, {.parity = config::Parity::none}), config::Recheck::off);
}

}  // namespace
}  // namespace baudgate::testing
