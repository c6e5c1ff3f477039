// The shipped SET-4TM profiles: every point can be asked, and comes back from the twin as
// simulated.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "config/loader.h"
#include "protocols/set4tm/meter/plan.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

config::Profile Load(const std::string& name) {
  config::Catalog catalog;
  catalog.protocols["set4tm"] = &Set4tmProtocol();
  auto loaded =
      config::LoadProfile("config/profiles/set4tm/" + name + ".yaml", Set4tmProtocol(), catalog);
  for (const config::Problem& problem : loaded.problems) ADD_FAILURE() << ToString(problem);
  return loaded.profile;
}

/// What the profile simulates: the low end of a range, or the text.
FixedValues Simulated(const std::vector<config::Point>& points) {
  FixedValues values;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const config::Point& point = points[i];
    if (!point.simulate) continue;
    if (point.simulate->text) {
      values.Set(i, *point.simulate->text);
    } else {
      values.Set(i, ((point.simulate->low - point.offset) / point.scale).ToDouble());
    }
  }
  return values;
}

class Set4tmProfile : public ::testing::TestWithParam<std::pair<std::string, const char*>> {};

TEST_P(Set4tmProfile, ComesBackFromTheTwinPointByPoint) {
  const config::Profile profile = Load(GetParam().first);
  ASSERT_FALSE(profile.points.empty());
  config::Device device = MakeDevice("1", profile.points);
  device.options.Set("snapshot", std::string(GetParam().second));
  FixedValues values = Simulated(device.points);
  MeterTwin twin(device, values);
  Talk talk(Set4tmProtocol(), device);
  std::vector<bool> seen(device.points.size());
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    const Answer answer = talk.Run(Poll(query), twin);
    ASSERT_EQ(answer.outcome, Outcome::ok) << answer.reason << TakeAsked(talk).back();
    for (const Reading& reading : answer.readings) {
      const config::Point& point = device.points.at(reading.point);
      seen[reading.point] = true;
      ASSERT_EQ(reading.quality, Quality::good) << point.name;
      const Value truth = values.Get(reading.point, talk.now);
      ASSERT_TRUE(HasValue(truth)) << point.name << " has no `simulate`";
      if (point.type == config::Type::string) {
        EXPECT_EQ(ToText(reading.value), ToText(truth)) << point.name;
      } else if (!point.read.ends_with("alarm@0")) {
        const double expected = ToDouble(truth);
        EXPECT_NEAR(ToDouble(reading.value), expected, std::abs(expected) * 1e-4 + 0.1)
            << point.name;
      }
    }
  }
  for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_TRUE(seen[i]) << device.points[i].name;
}

INSTANTIATE_TEST_SUITE_P(Shipped, Set4tmProfile,
                         ::testing::Values(std::pair{"set-4tm.03m", "false"},
                                           std::pair{"set-4tm.03m", "auto"},
                                           std::pair{"set-4tm.02", "auto"}));

TEST(Set4tmProfileLayout, FastBlockIsContiguousAndTakesFewRequests) {
  const config::Profile profile = Load("set-4tm.03m");
  std::size_t next = 0;
  for (const config::Point& point : profile.points) {
    if (point.group != config::Group::fast) continue;
    ASSERT_EQ(point.modbus, next) << point.name;
    next += config::RegisterCount(point);
  }
  EXPECT_EQ(next, 52U);
  config::Device device = MakeDevice("1", profile.points);
  MeterBus bus;
  const auto fast = [](const MeterConversation& conversation) {
    return std::ranges::count(conversation.Queries(), config::Group::fast, &Query::group);
  };
  EXPECT_EQ(fast(MeterConversation(device, ReadSettings(device.options), bus)), 8);
  device.options.Set("snapshot", std::string("true"));
  EXPECT_EQ(fast(MeterConversation(device, ReadSettings(device.options), bus)), 2);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
