// The key events: of the gateway, of devices and of profiles.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "config/loader.h"
#include "config/profile.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using ::testing::HasSubstr;

config::Loaded LoadWith(const std::string& top, const std::string& keys = "") {
  return Load(top +
              "lines:\n- { name: l, port: /dev/l, protocol: fake, devices: [\n"
              "{ name: d, address: 1" +
              keys + ", points: [{ name: a, read: A1, type: uint16 }] }] }\n");
}
bool Asked(const config::Loaded& loaded) { return loaded.config.lines.at(0).devices.at(0).events; }

TEST(EventsKey, IsOffUntilItIsGiven) {
  EXPECT_FALSE(Asked(LoadWith("")));
  EXPECT_FALSE(Asked(LoadWith("events: {}\n"))) << "nobody knows what its events mean";
  EXPECT_TRUE(Asked(LoadWith("", ", events: on")));
  EXPECT_FALSE(Asked(LoadWith("events: {}\n", ", events: off")));
  EXPECT_FALSE(LoadWith("").config.events.given);
  EXPECT_TRUE(LoadWith("events: {}\n").config.events.given);
  EXPECT_EQ(LoadWith("events: { directory: /data }\n").config.events.directory, "/data");
}

struct Table {
  std::vector<config::EventText> texts;
  std::vector<config::Problem> problems;
};
Table LoadTable(const std::string& events) {
  static const Protocol kProtocol = MakeFakeProtocol("fake");
  config::Problems problems;
  const std::string head = "device: D\npoints: [{ name: a, read: A1, type: uint16 }]\nevents:\n";
  const auto raw = config::ReadProfileText(head + events, "p.yaml", "p", kProtocol, problems);
  return {raw.profile.event_texts, problems.Sorted()};
}

TEST(EventTable, IsRead) {
  const auto loaded = LoadTable(
      "- { code: 1, text: started, state: on }\n- { code: 1, channel: 2, text: \"2\" }\n"
      "- { code: 2, text: reset, state: off }\n");
  ASSERT_EQ(Shown(loaded.problems), "");
  const auto& table = loaded.texts;
  ASSERT_EQ(table.size(), 3U);
  EXPECT_EQ(config::FindEvent(table, 0, 1)->text, "started");
  EXPECT_EQ(config::FindEvent(table, 0, 1)->state, config::EventState::on);
  EXPECT_EQ(config::FindEvent(table, 2, 1)->text, "2") << "of its channel";
  EXPECT_EQ(config::FindEvent(table, 2, 1)->state, config::EventState::message);
  EXPECT_EQ(config::FindEvent(table, 3, 2)->state, config::EventState::off);
  EXPECT_EQ(config::FindEvent(table, 0, 3), nullptr);
}

}  // namespace
}  // namespace baudgate::testing
