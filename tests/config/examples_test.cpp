// The shipped examples and every shipped profile load without any problem, with the real protocols.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/loader.h"
#include "protocols/dcon/protocol.h"
#include "protocols/set4tm/protocol.h"
#include "protocols/spabus/protocol.h"

namespace baudgate {

// Some descriptors stand in the namespace of their protocol.
namespace dcon {}
namespace set4tm {}
namespace spabus {}

namespace {

using namespace dcon;    // NOLINT
using namespace set4tm;  // NOLINT
using namespace spabus;  // NOLINT

const config::Catalog& Shipped() {
  static const config::Catalog kCatalog = {
      {{"dcon", &DconProtocol()}, {"set4tm", &Set4tmProtocol()}, {"spabus", &SpabusProtocol()}},
      {"config/profiles"}};
  return kCatalog;
}

std::string Shown(const std::vector<config::Problem>& problems) {
  std::string text;
  for (const config::Problem& problem : problems) text += config::ToString(problem) + "\n";
  return text;
}

TEST(Examples, LoadWithoutProblems) {
  for (const char* const file :
       {"config/examples/baudgate.yaml", "config/examples/substation.yaml"}) {
    const config::Loaded loaded = config::LoadFile(file, Shipped());
    EXPECT_EQ(Shown(loaded.problems), "") << file;
    EXPECT_EQ(loaded.config.lines.size(), 3U) << file;
  }
}

TEST(Examples, AnnotatedDefaultsAreTheDefaults) {
  const config::Loaded loaded = config::LoadFile("config/examples/baudgate.yaml", Shipped());
  ASSERT_TRUE(loaded.ok());
  const config::Config defaults;
  EXPECT_EQ(loaded.config.name, defaults.name);
  EXPECT_EQ(loaded.config.dds.heartbeat, defaults.dds.heartbeat);
  EXPECT_EQ(loaded.config.dds.interfaces, defaults.dds.interfaces);
  const config::Listener listener;
  const config::Listener& shown = loaded.config.modbus.listen.at(0);
  EXPECT_EQ(shown.max_clients, listener.max_clients);
  EXPECT_EQ(shown.idle_timeout, listener.idle_timeout);
  EXPECT_EQ(shown.priority, listener.priority);
  const config::Line line;
  EXPECT_EQ(loaded.config.lines.at(0).retries, line.retries);
  EXPECT_EQ(loaded.config.lines.at(0).echo, line.echo);
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

}  // namespace
}  // namespace baudgate
