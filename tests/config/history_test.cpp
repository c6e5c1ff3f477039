// The key history: which points it means, and what is wrong with it.
// SPDX-License-Identifier: Apache-2.0
#include "config/history.h"

#include <gmock/gmock.h>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"

namespace baudgate::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kFeeders =
    "lines:\n- { name: bay, port: /dev/l, protocol: fake, devices: [\n"
    "{ name: f1, address: 1, points: [{ name: current_l1, read: A1, type: float32, deadband: 0.25 "
    "}, "
    "{ name: group, read: A2, type: uint16 }] },\n"
    "{ name: f2, address: 2, points: [{ name: current_l1, read: A1, type: float32 }] }] }\n";

config::Loaded LoadHistory(const std::string& history) {
  return Load("history: " + history + "\n" + kFeeders);
}

std::vector<std::string> Names(const config::Loaded& loaded) {
  std::vector<std::string> names;
  for (const config::HistoryPoint& point : loaded.config.history.points) {
    const config::Device& device = loaded.config.lines.at(0).devices.at(point.device);
    names.push_back(device.name + "." + device.points.at(point.point).name);
  }
  return names;
}

TEST(HistoryPattern, HasStarsAndQuestionMarks) {
  EXPECT_TRUE(MatchesPattern("*", ""));
  EXPECT_TRUE(MatchesPattern("current_*", "current_l1"));
  EXPECT_TRUE(MatchesPattern("c*l?", "current_l1"));
  EXPECT_TRUE(MatchesPattern("*a*b", "aabab"));
  EXPECT_FALSE(MatchesPattern("*a*b", "aaba"));
  EXPECT_FALSE(MatchesPattern("current", "current_l1"));
  EXPECT_FALSE(MatchesPattern("?", ""));
}

TEST(HistoryKey, IsOffUntilItIsGiven) {
  EXPECT_FALSE(Load(kFeeders).config.history.on());
  const auto loaded = LoadHistory("{ points: [ '*.*.*' ] }");
  EXPECT_EQ(Shown(loaded.problems), "");
  EXPECT_EQ(loaded.config.history.limit, 1'000'000'000U);
  EXPECT_EQ(loaded.config.history.keep, 365 * 24h);
  EXPECT_EQ(loaded.config.history.points.size(), 3U);
}

TEST(HistoryKey, TheFirstThatFitsDecides) {
  const auto loaded = LoadHistory(
      "{ max_gap: 1h, points: [ { match: bay.f2.*, log: off }, { match: 'bay.*.cur*', max_gap: "
      "2min }, { match: '*.*.*', log: all, deadband: 2 } ] }");
  EXPECT_EQ(Shown(loaded.problems), "");
  EXPECT_THAT(Names(loaded), ElementsAre("f1.current_l1", "f1.group"));
  const auto& points = loaded.config.history.points;
  EXPECT_EQ(points[0].deadband, 0.25) << "the point's own";
  EXPECT_EQ(points[0].max_gap, 2min);
  EXPECT_FALSE(points[0].every);
  EXPECT_EQ(points[1].deadband, 2);
  EXPECT_EQ(points[1].max_gap, 1h);
  EXPECT_TRUE(points[1].every);
}

}  // namespace
}  // namespace baudgate::testing
