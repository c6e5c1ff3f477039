// Tests of the streams of points without a server and under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "gateway/outputs/web/live_streams.h"
#include "tests/gateway/outputs/status/two_lines.h"

namespace baudgate::web {
namespace {

using status::kNow;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

Now After(Duration time) { return {kNow.instant + time, kNow.wall + time}; }

std::string ReadAll(Stream& stream) {
  std::string all;
  std::array<char, 100> part{};
  for (;;) {
    const std::ptrdiff_t got = stream.Read(part);
    if (got == Stream::kEnd) return all + "(end)";
    if (got == 0) return all;
    all.append(part.data(), static_cast<std::size_t>(got));
  }
}

class LivePointsTest : public ::testing::Test {
 protected:
  void Put(std::uint32_t device, std::uint32_t point, double value, Now at) {
    const std::array<bus::Sample, 1> samples = {{{point, Value(value), Quality::good}}};
    store_.Update(device, samples, at, 20ms);
  }

  config::Config config_ = status::TwoLines();
  bus::PointStore store_{config_};
  LivePoints live_{store_, nullptr};
};

TEST_F(LivePointsTest, AViewerGetsASnapshotAndThenChanges) {
  Put(0, 1, 0.5, kNow);
  const auto viewer = live_.Join(std::nullopt, kNow);
  const std::string first = ReadAll(*viewer);
  EXPECT_THAT(first, StartsWith("event: snapshot\ndata: {\"time_ms\":1790000000000,"
                                "\"generation\":1,\"values\":[[0,null,32,"));
  EXPECT_THAT(first, HasSubstr("[1,0.5,192,\"good\",1790000000000,\"0.5000\"]"));
  EXPECT_THAT(first, HasSubstr("event: alarms\ndata: {\"active\":0,\"unacknowledged\":0,"
                               "\"worst\":null}\n\n"));
  EXPECT_TRUE(live_.Tick(After(200ms)));
  EXPECT_EQ(ReadAll(*viewer), "") << "nothing has changed";
  Put(2, 0, 7, After(300ms));
  Put(2, 0, 8, After(350ms));
  EXPECT_TRUE(live_.Tick(After(400ms)));
  EXPECT_EQ(ReadAll(*viewer),
            "event: change\ndata: {\"time_ms\":1790000000400,\"generation\":1,\"values\":"
            "[[4,8,192,\"good\",1790000000350,\"8.000\"]]}\n\n");
  EXPECT_TRUE(live_.Tick(After(1s)));
  EXPECT_EQ(ReadAll(*viewer), "event: beat\ndata: {\"time_ms\":1790000001000}\n\n");
}

TEST_F(LivePointsTest, AViewerOfADeviceGetsOnlyItsValues) {
  const auto viewer = live_.Join(2, kNow);
  EXPECT_THAT(ReadAll(*viewer), HasSubstr("\"values\":[[4,null,32,"));
  Put(0, 0, 1, kNow);
  live_.Tick(After(200ms));
  EXPECT_EQ(ReadAll(*viewer), "");
  Put(2, 1, 1, kNow);
  live_.Tick(After(400ms));
  EXPECT_THAT(ReadAll(*viewer), HasSubstr("\"values\":[[5,1,192,"));
}

TEST_F(LivePointsTest, ValuesOfAnOfflineDeviceAreBad) {
  Put(0, 1, 0.5, kNow);
  const auto viewer = live_.Join(0, kNow);
  EXPECT_THAT(ReadAll(*viewer), HasSubstr("[1,0.5,192,"));
  store_.SetOverride(0, Quality::bad_communication);
  live_.Tick(After(200ms));
  const int bad = Quality(Quality::bad_communication).word();
  EXPECT_THAT(ReadAll(*viewer), HasSubstr("[1,0.5," + std::to_string(bad) + ","));
}

TEST_F(LivePointsTest, WithoutViewersTheTickStops) {
  EXPECT_FALSE(live_.watched());
  auto viewer = live_.Join(std::nullopt, kNow);
  EXPECT_TRUE(live_.Tick(After(200ms)));
  viewer.reset();
  EXPECT_FALSE(live_.Tick(After(400ms)));
  EXPECT_FALSE(live_.watched());
}

TEST_F(LivePointsTest, ASlowViewerGetsANewSnapshot) {
  const auto slow = live_.Join(std::nullopt, kNow);
  const auto fast = live_.Join(std::nullopt, kNow);
  ReadAll(*slow);
  for (std::size_t i = 1; i <= 2 * Frames::kMostFrames; ++i) {
    Put(0, 0, static_cast<double>(i), After(i * 200ms));
    live_.Tick(After(i * 200ms));
    EXPECT_THAT(ReadAll(*fast), HasSubstr("[0," + std::to_string(i) + ",192"));
  }
  EXPECT_EQ(ReadAll(*slow), "") << "it waits for a snapshot";
  live_.Tick(After(10'200ms));
  const std::string anew = ReadAll(*slow);
  EXPECT_THAT(anew, StartsWith("event: snapshot"));
  EXPECT_THAT(anew, HasSubstr("[0,50,192"));
  EXPECT_THAT(ReadAll(*fast), Not(HasSubstr("snapshot")));
}

TEST_F(LivePointsTest, AReloadEndsAllStreams) {
  const auto viewer = live_.Join(std::nullopt, kNow);
  ReadAll(*viewer);
  live_.EndAll();
  EXPECT_EQ(ReadAll(*viewer), "event: reload\ndata: {}\n\n(end)");
  EXPECT_FALSE(live_.watched());
  EXPECT_THAT(ReadAll(*live_.Join(std::nullopt, kNow)), HasSubstr("\"generation\":2"));
}

TEST_F(LivePointsTest, ViewersAreWokenByNewFrames) {
  const auto viewer = live_.Join(std::nullopt, kNow);
  int woken = 0;
  viewer->SetWake([&woken] { ++woken; });
  live_.Tick(After(200ms));
  EXPECT_EQ(woken, 0);
  Put(0, 0, 1, kNow);
  live_.Tick(After(400ms));
  EXPECT_EQ(woken, 1);
}

}  // namespace
}  // namespace baudgate::web
