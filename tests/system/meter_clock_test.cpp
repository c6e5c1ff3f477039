// Tests whether the gateway corrects a meter's clock that is a minute ahead. The test chooses
// whether the host's clock counts as synchronised (tests/system/host_clock/said_clock.cpp).
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <fstream>
#include <iterator>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int kClockUnit = 21;
constexpr int kDrift = 8000;
constexpr int kUncertain = 0x58;
constexpr std::uint64_t kCorrected = 1000020;

/// Returns the UTC offset at which a clock shows 12:15 plus `ahead` now. Example: "-03:17".
std::string ZoneOf(std::chrono::minutes ahead) {
  using std::chrono::floor;
  const auto now = floor<std::chrono::minutes>(std::chrono::system_clock::now());
  const auto of_day = now - floor<std::chrono::days>(now);
  const auto offset = (std::chrono::minutes(12 * 60 + 15) - of_day + ahead).count();
  const auto size = offset < 0 ? -offset : offset;
  return fmt::format("{}{:02}:{:02}", offset < 0 ? '-' : '+', size / 60, size % 60);
}

class MeterClock : public Station {
 protected:
  MeterClock() {
    PinProfile("set4tm", "set-4tm.03m", "meter", {});
    std::ifstream file(directory() / "profiles/set4tm/meter.yaml");
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    Write("profiles/set4tm/twin.yaml", "time_zone: \"" + ZoneOf(1min) + "\"\n" + text);
    twin_ = StartTwin("meters", "twin", "200");
  }

  std::filesystem::path Say(bool host_clock_is_right) const {
    return Write("host_clock", host_clock_is_right ? "right" : "unknown");
  }
  bool EventuallyTold(const std::string& said) const {
    return Eventually([&] { return ReadWholeFile(directory() / "host_clock.told") == said; });
  }
  void ExpectLeftAlone() {
    ASSERT_TRUE(EventuallyQuality(client_, kClockUnit, kDrift, kUncertain)) << daemon_->Errors();
    for (int reading = 0; reading < 10; ++reading) {
      const Finished read = Ask({"read", "meters.meters-1.clock_drift"});
      ASSERT_EQ(read.code, 0) << read.errors;
      ASSERT_FALSE(Eventually([&] { return !Lines("writes").empty(); }, 500ms));
    }
    EXPECT_THAT(Corrections(), IsEmpty());
  }

  void Run(bool host_clock_is_right) {
    const std::string yaml =
        "events: {}\n" + WithSocket(Head()) +
        Line("meters", "set4tm",
             "address: 200, profile: meter, unit: 21, poll: 300ms, "
             "time_zone: \"" +
                 ZoneOf(0min) +
                 "\", correct_clock: 5s, "
                 "correct_clock_most: 90s, write: [clock_correction], points: [" +
                 fmt::format("{{ name: clock_drift, read: \"04 00 drift@0\", type: float64, unit: "
                             "s, group: fast, modbus: {} }}, ",
                             kDrift) +
                 "{ name: clock_correction, write: \"03 0B\", type: bool, access: w }]",
             "serial: 115200 8O1");
    daemon_ = Start({"run", "-c", Write("baudgate.yaml", yaml).string()},
                    {{"LD_PRELOAD", SAID_CLOCK},
                     {"SAID_CLOCK", Say(host_clock_is_right).string()},
                     {"ASAN_OPTIONS", "verify_asan_link_order=0"}});
  }
  std::vector<Json> Lines(const std::string& command) const {
    return JsonLines(Ask({command, "--json"}).output);
  }
  std::vector<Json> Corrections() const {
    std::vector<Json> all;
    for (Json& event : Lines("events")) {
      if (event.at("code") == kCorrected) all.push_back(std::move(event));
    }
    return all;
  }

  ModbusClient client_{port()};
  std::unique_ptr<Child> twin_;
  std::unique_ptr<Child> daemon_;
};

TEST_F(MeterClock, IsCorrectedOnceAndRecorded) {
  Run(true);
  ASSERT_TRUE(Eventually([&] { return !Corrections().empty(); })) << daemon_->Errors();
  EXPECT_THAT(Corrections().front().at("text"), HasSubstr("s ahead"));
  const auto writes = Lines("writes");
  ASSERT_THAT(writes, SizeIs(1));
  EXPECT_EQ(writes[0].at("client"), "gateway");
  EXPECT_EQ(writes[0].at("point"), "clock_correction");
  EXPECT_EQ(writes[0].at("outcome"), "ok");
  EXPECT_TRUE(Eventually([&] {
    const auto drift = client_.Double(kClockUnit, kDrift);
    return drift && *drift > -2 && *drift < 2;
  }));
}

TEST_F(MeterClock, IsNotCorrectedWithoutASynchronisedHostClock) {
  Run(false);
  ExpectLeftAlone();
}

TEST_F(MeterClock, IsNotCorrectedOnceTheHostClockLosesSynchronisation) {
  twin_.reset();
  Run(true);
  ASSERT_TRUE(EventuallyTold("right")) << daemon_->Errors();
  Say(false);
  ASSERT_TRUE(EventuallyTold("unknown"));
  twin_ = StartTwin("meters", "twin", "200");
  ExpectLeftAlone();
}

}  // namespace
}  // namespace baudgate::system_test
