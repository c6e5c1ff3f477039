// The shipped examples and every shipped profile load without any problem, with the real protocols.
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
  } kExamples[] = {{"baudgate.yaml", 4}, {"digi-one.yaml", 1}, {"substation.yaml", 3}};
  for (const auto& example : kExamples) {
    const config::Loaded loaded =
        config::LoadFile(std::string("config/examples/") + example.file, Shipped());
    EXPECT_EQ(Shown(loaded.problems), "") << example.file;
    EXPECT_EQ(loaded.config.lines.size(), example.lines) << example.file;
  }
}

TEST(Examples, DigiOneLeadsToTheDrive) {
  const auto loaded = config::LoadFile("config/examples/digi-one.yaml", Shipped());
  ASSERT_TRUE(loaded.ok());
  ASSERT_EQ(loaded.config.modbus.routes.size(), 1U);
  const config::Route& route = loaded.config.modbus.routes[0];
  EXPECT_EQ(route.Units(), "20");
  EXPECT_EQ(route.Target(), "line drive");
  EXPECT_EQ(loaded.config.lines[route.line_index].serial.ToString(), "19200 8E1");
  const config::Listener& listener = loaded.config.modbus.listen.at(0);
  EXPECT_EQ(listener.Place(), "0.0.0.0:502");
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

TEST(Examples, ADeviceKnowsWhatOnlyOtherTypesCallThemselves) {
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
  EXPECT_NE(
      Shown(wrong.problems).find("identity: 'ignored' is neither 'ignore' nor a list of names"),
      std::string::npos)
      << Shown(wrong.problems);
}

TEST(Examples, AnnotatedDefaultsAreTheDefaults) {
  const config::Loaded loaded = config::LoadFile("config/examples/baudgate.yaml", Shipped());
  ASSERT_TRUE(loaded.ok());
  const config::Config defaults;
  EXPECT_EQ(loaded.config.name, defaults.name);
  EXPECT_EQ(loaded.config.recordings, "/var/lib/baudgate/recordings");
  EXPECT_EQ(loaded.config.socket, "/run/baudgate/baudgate.sock");
  EXPECT_EQ(loaded.config.dds.heartbeat, defaults.dds.heartbeat);
  EXPECT_EQ(loaded.config.dds.write, defaults.dds.write);
  EXPECT_EQ(loaded.config.dds.interfaces, defaults.dds.interfaces);
  const config::Listener listener;
  const config::Listener& shown = loaded.config.modbus.listen.at(0);
  EXPECT_EQ(shown.max_clients, listener.max_clients);
  EXPECT_EQ(shown.idle_timeout, listener.idle_timeout);
  EXPECT_EQ(shown.Place(), listener.Place());
  EXPECT_EQ(shown.protocol, listener.protocol);
  EXPECT_EQ(shown.permit, listener.permit);
  EXPECT_EQ(shown.priority, listener.priority);
  EXPECT_EQ(shown.errors, listener.errors);
  EXPECT_EQ(shown.broadcast, listener.broadcast);
  EXPECT_TRUE(shown.clients.empty() && shown.functions.empty());
  EXPECT_EQ(loaded.config.modbus.routes.at(2).deadline, config::Route().deadline);
  EXPECT_EQ(loaded.config.modbus.listen.at(2).serial.ToString(), "19200 8E1");
  const config::Line line;
  EXPECT_EQ(loaded.config.lines.at(0).retries, line.retries);
  EXPECT_EQ(loaded.config.lines.at(0).echo, line.echo);
  const config::Line& bay = loaded.config.lines.at(0);
  const config::Timing own = Shipped().FindProtocol("spabus")->timing(bay.serial);
  const auto about = [](std::optional<Duration> written, std::optional<Duration> real) {
    return static_cast<double>(written->count()) / static_cast<double>(real->count());
  };
  EXPECT_NEAR(about(bay.timing.quiet, own.quiet), 1, 0.01);
  EXPECT_NEAR(about(bay.timing.reply, own.reply), 1, 0.01);
  EXPECT_NEAR(about(bay.timing.gap, own.gap), 1, 0.01);
  EXPECT_NEAR(about(bay.timing.ceiling, own.ceiling), 1, 0.01);
  EXPECT_NEAR(about(bay.timing.drain, own.drain), 1, 0.01);
  const config::Device device;
  const config::Device& feeder = loaded.config.lines.at(0).devices.at(0);
  EXPECT_EQ(feeder.poll, device.poll);
  EXPECT_EQ(feeder.slow, device.slow);
  EXPECT_EQ(feeder.on_bad, device.on_bad);
  EXPECT_EQ(feeder.word_order, device.word_order);
}

TEST(Profiles, AllShippedLoadWithoutProblems) {
  const auto files = Shipped().Profiles();
  EXPECT_GE(files.size(), 3U);
  for (const config::ProfileFile& file : files) {
    const Protocol* protocol = Shipped().FindProtocol(file.protocol);
    ASSERT_NE(protocol, nullptr) << file.path;
    const auto loaded = config::LoadProfile(file.path.string(), *protocol, Shipped());
    EXPECT_EQ(Shown(loaded.problems), "") << file.path;
    EXPECT_FALSE(loaded.profile.points.empty()) << file.path;
    for (const config::Point& point : loaded.profile.points) {
      EXPECT_FALSE(point.description.empty()) << file.path << ' ' << point.name;
    }
  }
}

/// What a profile repeats needlessly could no longer be set for a whole line or gateway.
TEST(Profiles, SayNothingThatIsTheDefault) {
  for (const config::ProfileFile& file : Shipped().Profiles()) {
    const Protocol& protocol = *Shipped().FindProtocol(file.protocol);
    const config::Pace pace =
        config::LoadProfile(file.path.string(), protocol, Shipped()).profile.pace;
    const config::Timing fallback = protocol.timing(protocol.serial);
    EXPECT_NE(pace.poll, config::Device().poll) << file.path;
    EXPECT_NE(pace.slow, config::Device().slow) << file.path;
    EXPECT_NE(pace.retries, config::Line().retries) << file.path;
    EXPECT_NE(pace.timing.quiet, fallback.quiet) << file.path;
    EXPECT_NE(pace.timing.reply, fallback.reply) << file.path;
    EXPECT_NE(pace.timing.gap, fallback.gap) << file.path;
    EXPECT_NE(pace.timing.ceiling, fallback.ceiling) << file.path;
    EXPECT_NE(pace.timing.drain, fallback.drain) << file.path;
  }
}

}  // namespace
}  // namespace baudgate::testing
