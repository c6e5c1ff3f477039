// The shipped profiles: they load, and every point of theirs survives a round trip with its twin.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include "config/loader.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

constexpr char kProfiles[] = "config/profiles";

class SpaProfile : public ::testing::TestWithParam<std::string> {
 protected:
  config::Profile Load() {
    config::Catalog catalog;
    catalog.protocols["spabus"] = &SpabusProtocol();
    catalog.profile_dirs = {kProfiles};
    const auto loaded = config::LoadProfile(GetParam(), SpabusProtocol(), catalog);
    for (const config::Problem& problem : loaded.problems)
      ADD_FAILURE() << config::ToString(problem);
    return loaded.profile;
  }
};

TEST_P(SpaProfile, LoadsAndIsComplete) {
  const config::Profile profile = Load();
  EXPECT_FALSE(profile.title.empty());
  EXPECT_GT(profile.points.size(), 40U);
  for (const config::Point& point : profile.points) {
    EXPECT_FALSE(point.description->empty()) << point.name;
    EXPECT_TRUE(point.simulate) << point.name;
    EXPECT_TRUE(point.modbus) << point.name;
  }
}

TEST_P(SpaProfile, FastValuesStandTogetherAtTheBeginning) {
  std::map<config::Table, std::size_t> next;
  for (const config::Point& point : Load().points) {
    if (point.group != Group::fast || point.table == config::Table::bits) continue;
    EXPECT_EQ(*point.modbus, next[point.table]) << point.name;
    next[point.table] += config::RegisterCount(point);
  }
}

Value Simulated(const config::Point& point) {
  if (point.simulate->text) return *point.simulate->text;
  if (point.type == Type::boolean) return point.simulate->low != 0;
  return point.simulate->low;
}

TEST_P(SpaProfile, EveryPointComesBackFromItsTwin) {
  const config::Profile profile = Load();
  config::Device device = MakeDevice(profile.points);
  FixedValues values;
  for (std::size_t i = 0; i < device.points.size(); ++i) values.Set(i, Simulated(device.points[i]));
  const auto twin = SpabusProtocol().make_twin(device, values);
  Talk talk(SpabusProtocol(), device);
  std::set<std::size_t> seen;
  for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
    const Answer answer = talk.Exchange(Poll(query), *twin);
    EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
    for (const Reading& reading : answer.readings) {
      ASSERT_LT(reading.point, device.points.size());
      const config::Point& point = device.points[reading.point];
      EXPECT_EQ(reading.quality, Quality::good) << point.name;
      if (point.simulate->text) {
        EXPECT_EQ(ToText(reading.value), *point.simulate->text) << point.name;
      } else {
        EXPECT_DOUBLE_EQ(ToDouble(reading.value), point.simulate->low) << point.name;
      }
      seen.insert(reading.point);
    }
  }
  const auto is_read = [](const config::Point& point) { return point.access != Access::write; };
  EXPECT_EQ(seen.size(), std::ranges::count_if(device.points, is_read));
}

TEST_P(SpaProfile, WritablePointsTakeTheirSimulatedValue) {
  const config::Profile profile = Load();
  config::Device device = MakeDevice(profile.points);
  FixedValues values;
  const auto twin = SpabusProtocol().make_twin(device, values);
  Talk talk(SpabusProtocol(), device);
  std::size_t written = 0;
  for (std::size_t i = 0; i < device.points.size(); ++i) {
    const config::Point& point = device.points[i];
    if (point.access == Access::read) continue;
    const Answer answer = talk.Run(Write(i, Simulated(point)), *twin);
    EXPECT_EQ(answer.outcome, Outcome::ok) << point.name << ": " << answer.reason;
    EXPECT_DOUBLE_EQ(ToDouble(values.Get(i, {})), point.simulate->low) << point.name;
    ++written;
  }
  EXPECT_GT(written, 0U);
}

// ---------------------------------------------------------------- what may be written

/// Chapters 15.1 and 15.2 of the SPA reference. No decimals: whole numbers.
struct Allowed {
  std::string item;
  std::optional<double> min;
  std::optional<double> max;
  std::optional<int> decimals;
  bool select = false;
};

std::vector<Allowed> RangeOf(int first, int last, const Allowed& each) {
  std::vector<Allowed> all;
  for (int number = first; number <= last; ++number) {
    all.push_back(each);
    all.back().item = "S" + std::to_string(number);
  }
  return all;
}

std::vector<Allowed> AllowedOf(const std::string& profile) {
  const bool is_spaj = profile == "spaj140c";
  std::vector<Allowed> all = {
      {"C", 0, 0, {}, false},
      {"V101", 1, 1, {}, true},
      {"V102", 1, 1, {}, true},
      {"V165", 1, 1, {}, true},
      {"V150", 0, 1, {}, true},
      {"V155", 0, 255, {}, false},
      {"V156", 0, is_spaj ? 255 : 15, {}, false},
      {"V157", 0, is_spaj ? 1023 : 1, {}, false},
  };
  const auto add = [&all](const std::vector<Allowed>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  if (!is_spaj) {
    add(RangeOf(21, 25, {{}, 0, 999, 2, false}));
    return all;
  }
  for (const char* output : {"O9", "O10", "O11", "O12", "O13", "O41"}) {
    all.push_back({output, {}, {}, {}, true});
  }
  for (const int first : {21, 41}) {
    add(RangeOf(first, first + 7, {{}, {}, {}, 2, false}));
    add(RangeOf(first + 8, first + 13, {{}, 0, 255, {}, false}));
  }
  all.push_back({"S61", 0.1, 1.0, 2, false});
  return all;
}

TEST_P(SpaProfile, LimitsAreThoseOfTheReference) {
  std::map<std::string, Allowed> expected;
  for (const Allowed& one : AllowedOf(GetParam())) expected[one.item] = one;
  for (const config::Point& point : Load().points) {
    if (point.access == Access::read) continue;
    const std::string& item = point.write.empty() ? point.read : point.write;
    ASSERT_TRUE(expected.contains(item)) << item << " can be written";
    const Allowed& allowed = expected[item];
    EXPECT_EQ(point.writing.min, allowed.min) << item;
    EXPECT_EQ(point.writing.max, allowed.max) << item;
    EXPECT_EQ(point.writing.decimals, allowed.decimals) << item;
    EXPECT_EQ(point.writing.select, allowed.select) << item;
    expected.erase(item);
  }
  for (const auto& [item, allowed] : expected) ADD_FAILURE() << item << " cannot be written";
}

INSTANTIATE_TEST_SUITE_P(Shipped, SpaProfile, ::testing::Values("spaj140c", "spau130c"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace baudgate::protocols::spabus
