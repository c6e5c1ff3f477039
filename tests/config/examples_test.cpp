// Tests that the shipped examples and profiles load without problems, with the real protocols.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

TEST(Examples, LoadWithoutProblems) {
  const struct {
    const char* file;
    std::size_t lines;
  } kExamples[] = {{"baudgate.yaml", 5}, {"digi-one.yaml", 1}, {"substation.yaml", 3}};
  for (const auto& example : kExamples) {
    const config::Loaded loaded =
        config::LoadFile(std::string("config/examples/") + example.file, Shipped());
    EXPECT_EQ(Shown(loaded.problems), "") << example.file;
    EXPECT_EQ(loaded.config.lines.size(), example.lines) << example.file;
  }
}

TEST(Examples, DigiOneRoutesToTheDrive) {
  const auto loaded = config::LoadFile("config/examples/digi-one.yaml", Shipped());
  ASSERT_TRUE(loaded.ok());
  ASSERT_EQ(loaded.config.modbus.routes.size(), 1U);
  const config::Route& route = loaded.config.modbus.routes[0];
  EXPECT_EQ(route.Units(), "20");
  EXPECT_EQ(route.Target(), "line drive");
  EXPECT_EQ(loaded.config.lines[route.line_index].serial.ToString(), "19200 8E1");
  const config::Listener& listener = loaded.config.modbus.listen.at(0);
  EXPECT_EQ(listener.Address(), "0.0.0.0:502");
  ASSERT_EQ(listener.clients.size(), 1U);
  EXPECT_EQ(listener.clients[0].priority, config::Priority::high);
  ASSERT_EQ(listener.functions.size(), 1U);
  EXPECT_EQ(listener.functions[0].priority, config::Priority::high);
}

config::Identity IdentityOf(const std::string& keys) {
  const config::Loaded loaded = config::LoadText(
      "lines: [{ name: l, port: /dev/l, protocol: spabus, devices: [{ name: d, address: 1, " +
          keys + " }] }]\n",
      "t.yaml", Shipped());
  EXPECT_EQ(Shown(loaded.problems), "");
  return loaded.ok() ? loaded.config.lines[0].devices[0].identity : config::Identity();
}

TEST(Examples, ADeviceKnowsTheIdentityNamesOfOtherTypes) {
  const config::Identity shipped = IdentityOf("profile: spaj140c");
  EXPECT_EQ(shipped.names.front(), "SPCJ 4D29");
  EXPECT_EQ(shipped.others, (std::map<std::string, std::string>{{"SPAU130C", "spau130c"}}));
  const config::Identity own = IdentityOf("profile: spaj140c, identity: [\"spau 130 c\"]");
  EXPECT_EQ(own.names, std::vector<std::string>{"spau 130 c"});
  EXPECT_TRUE(own.others.empty()) << "the user lists it";
  EXPECT_TRUE(IdentityOf("profile: spaj140c, identity: ignore").ignore);
  const config::Loaded wrong = config::LoadText(
      "lines: [{ name: l, port: /dev/l, protocol: spabus, devices: [{ name: d, address: 1, "
      "profile: spaj140c, identity: ignored }] }]\n",
      "t.yaml", Shipped());
  EXPECT_NE(Shown(wrong.problems)
                .find("identity: 'ignored' is neither 'ignore' nor a list of names; write for "
                      "example identity: [\"NAME\"]"),
            std::string::npos)
      << Shown(wrong.problems);
}

TEST(Examples, AnnotatedDefaultsAreTheDefaults) {
  const config::Loaded loaded = config::LoadFile("config/examples/baudgate.yaml", Shipped());
  ASSERT_TRUE(loaded.ok());
  const config::Config& shown = loaded.config;
  EXPECT_EQ(DifferentKeys(shown, config::Config()),
            "gateway.recordings, gateway.state, gateway.socket, modbus, lines");
  EXPECT_EQ(DifferentKeys(shown.dds, config::Dds()), "");
  EXPECT_EQ(DifferentKeys(shown.modbus.listen.at(0), config::Listener()), "");
  EXPECT_EQ(DifferentKeys(shown.modbus.routes.at(2), config::Route()), "units, units, host");
  EXPECT_EQ(shown.modbus.listen.at(2).serial.ToString(), "19200 8E1");
  const config::Line& bay = shown.lines.at(0);
  EXPECT_EQ(DifferentKeys(bay, config::Line()),
            "name, port, serial, protocol, timing, options, devices");
  const config::Timing own = Shipped().FindProtocol("spabus")->timing(bay.serial);
  for (const auto& [name, time] : config::kNamedTimes) {
    const auto written = static_cast<double>((bay.timing.*time)->count());
    EXPECT_NEAR(written / static_cast<double>((own.*time)->count()), 1, 0.01) << name;
  }
  EXPECT_EQ(DifferentKeys(bay.devices.at(0), config::Device()),
            "name, address, protocol, profile, title, unit, max_age, dead_age, retries, timing, "
            "identity, options, points, event_texts, records");
}

TEST(Profiles, AllShippedProfilesLoadWithoutProblems) {
  const auto files = Shipped().Profiles();
  EXPECT_GE(files.size(), 3U);
  for (const config::ProfileFile& file : files) {
    const protocols::Protocol* protocol = Shipped().FindProtocol(file.protocol);
    ASSERT_NE(protocol, nullptr) << file.path;
    const auto loaded = config::LoadProfile(file.path.string(), *protocol, Shipped());
    EXPECT_EQ(Shown(loaded.problems), "") << file.path;
    EXPECT_FALSE(loaded.profile.points.empty()) << file.path;
    for (const config::Point& point : loaded.profile.points) {
      EXPECT_FALSE(point.description->empty()) << file.path << ' ' << point.name;
    }
  }
}

/// A key with its default value would override the setting of a line or gateway.
TEST(Profiles, ContainNoKeyWithItsDefaultValue) {
  for (const config::ProfileFile& file : Shipped().Profiles()) {
    const protocols::Protocol& protocol = *Shipped().FindProtocol(file.protocol);
    const config::Pace pace =
        config::LoadProfile(file.path.string(), protocol, Shipped()).profile.pace;
    const config::Timing fallback = protocol.timing(protocol.serial);
    EXPECT_NE(pace.poll, config::Device().poll) << file.path;
    EXPECT_NE(pace.slow, config::Device().slow) << file.path;
    EXPECT_NE(pace.retries, config::Line().retries) << file.path;
    for (const auto& [name, time] : config::kNamedTimes) {
      EXPECT_NE(pace.timing.*time, fallback.*time) << file.path << ' ' << name;
    }
  }
}

}  // namespace
}  // namespace baudgate::testing
