// The shipped DCON profiles: they load, every point is answered by a twin of the device, and every
// writable point can be written.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "config/loader.h"
#include "tests/protocols/dcon/support.h"

namespace baudgate::protocols::dcon {
namespace {

config::Catalog Installed() {
  config::Catalog catalog;
  catalog.protocols["dcon"] = &DconProtocol();
  catalog.profile_dirs = {"config/profiles"};  // tests run at the root of the source tree
  return catalog;
}

config::Loaded Load(const std::string& profile, const std::string& options) {
  const std::string text =
      "lines:\n  - name: io\n    port: /dev/null\n    protocol: dcon\n    devices:\n"
      "      - { name: module, address: 1, unit: 1, profile: " +
      profile + options + " }\n";
  return config::LoadText(text, "test.yaml", Installed());
}

Value Simulated(const config::Point& point) {
  if (!point.simulate) return {};
  if (point.simulate->text && point.type == config::Type::string) return *point.simulate->text;
  return point.simulate->low;
}

class DconProfile : public ::testing::TestWithParam<std::string> {
 protected:
  void RoundTripAll(const std::string& options) {
    const config::Loaded loaded = Load(GetParam(), options);
    for (const auto& problem : loaded.problems) ADD_FAILURE() << config::ToString(problem);
    ASSERT_TRUE(loaded.ok());
    const config::Device& device = loaded.config.lines.at(0).devices.at(0);
    FixedValues values;
    for (std::size_t i = 0; i < device.points.size(); ++i) {
      values.values[i] = Simulated(device.points[i]);
      EXPECT_TRUE(HasValue(values.values[i])) << device.points[i].name << " has no simulate";
      EXPECT_FALSE(device.points[i].description->empty()) << device.points[i].name;
    }
    DconTwin twin(device, values);
    Talk talk(DconProtocol(), device);
    std::vector<bool> seen(device.points.size(), false);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      seen[i] = device.points[i].access == config::Access::write;
    }
    for (std::size_t query = 0; query < talk->Queries().size(); ++query) {
      Answer answer = talk.Run(Poll(query), twin);
      // A task has few exchanges, and eight inputs may have a type each.
      for (int more = 0; more < 3 && answer.then == Then::replan; ++more) {
        answer = talk.Run(Poll(query), twin);
      }
      EXPECT_EQ(answer.outcome, Outcome::ok) << answer.reason;
      for (const Reading& reading : answer.readings) Check(device, values, reading, seen);
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), false), 0);
    for (std::size_t i = 0; i < device.points.size(); ++i) {
      if (device.points[i].access == config::Access::read) continue;
      const Answer answer = talk.Run(Write(i, 1.0), twin);
      EXPECT_EQ(answer.outcome, Outcome::ok) << device.points[i].name << ": " << answer.reason;
      const double expected = IsAction(device.points[i].write) ? 0 : 1;
      EXPECT_EQ(ToDouble(values.values[i]), expected) << device.points[i].name;
    }
  }

  /// It has no state.
  static bool IsAction(std::string_view write) { return write.ends_with("{clear}"); }

  static void Check(const config::Device& device, const FixedValues& values, const Reading& reading,
                    std::vector<bool>& seen) {
    Value truth = values.values.at(reading.point);
    if (device.points[reading.point].read == "$2" && device.options.Flag("checksum")) {
      truth = ToText(truth).replace(4, 2, "40");  // the twin's format byte tells its checksum
    }
    seen[reading.point] = true;
    EXPECT_EQ(reading.quality, Quality::good) << device.points[reading.point].name;
    if (std::holds_alternative<std::string>(truth)) {
      EXPECT_EQ(reading.value, truth);
    } else {
      EXPECT_NEAR(ToDouble(reading.value), ToDouble(truth), 0.051)
          << device.points[reading.point].name;
    }
  }
};

TEST_P(DconProfile, RoundTripAsShipped) { RoundTripAll(""); }
TEST_P(DconProfile, RoundTripWithChecksum) { RoundTripAll(", checksum: true"); }
TEST_P(DconProfile, RoundTripWithoutChecksum) { RoundTripAll(", checksum: false"); }

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const auto& file : Installed().Profiles("dcon")) names.push_back(file.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Shipped, DconProfile, ::testing::ValuesIn(Names()),
                         [](const ::testing::TestParamInfo<std::string>& info) {
                           std::string name = info.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST(DconProfiles, TheReferenceDeviceIsShipped) {
  const std::vector<std::string> names = Names();
  EXPECT_NE(std::find(names.begin(), names.end(), "owen-mv110-8a"), names.end());
  const config::Loaded loaded = Load("owen-mv110-8a", "");
  ASSERT_TRUE(loaded.ok());
  const config::Device& device = loaded.config.lines[0].devices[0];
  ASSERT_EQ(device.points.size(), 8U);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(device.points[i].modbus, 2 * i);
  EXPECT_TRUE(device.options.Flag("checksum"));
  EXPECT_EQ(device.timing.reply, std::optional<Duration>(1s));
}

TEST(DconProfiles, AnUnquotedHashIsExplained) {
  const config::Loaded loaded = config::LoadText(
      "lines:\n  - name: io\n    port: /dev/null\n    protocol: dcon\n    devices:\n"
      "      - name: module\n        address: 1\n        points:\n"
      "          - name: a\n            read: #[0]\n            type: float32\n",
      "test.yaml", Installed());
  EXPECT_FALSE(loaded.ok());
  const bool told = std::any_of(
      loaded.problems.begin(), loaded.problems.end(),
      [](const auto& problem) { return problem.message.find("quote") != std::string::npos; });
  EXPECT_TRUE(told) << (loaded.problems.empty() ? "" : config::ToString(loaded.problems[0]));
}

}  // namespace
}  // namespace baudgate::protocols::dcon
