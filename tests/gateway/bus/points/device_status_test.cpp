// The histogram of round trips: bounded, and true within a quarter of an octave.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/device_status.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace baudgate {
namespace {

TEST(RoundTrips, EmptyIsZero) {
  const RoundTrips trips;
  EXPECT_EQ(trips.count(), 0U);
  EXPECT_EQ(trips.mean(), Duration::zero());
  EXPECT_EQ(trips.Percentile(0.99), Duration::zero());
}

TEST(RoundTrips, LastAndMeanAreExact) {
  RoundTrips trips;
  for (const Duration one : {10ms, 20ms, 60ms}) trips.Add(one);
  EXPECT_EQ(trips.count(), 3U);
  EXPECT_EQ(trips.last(), 60ms);
  EXPECT_EQ(trips.mean(), 30ms);
}

TEST(RoundTrips, PercentileIsAnUpperBoundWithinNineteenPercent) {
  std::mt19937 random(3);
  std::lognormal_distribution<double> spread(std::log(20e6), 1.0);
  RoundTrips trips;
  std::vector<double> all;
  for (int i = 0; i < 20000; ++i) {
    all.push_back(std::clamp(spread(random), 70e3, 60e9));
    trips.Add(Duration(std::llround(all.back())));
  }
  std::sort(all.begin(), all.end());
  for (const double share : {0.5, 0.9, 0.99, 1.0}) {
    const double truth = all[static_cast<std::size_t>(share * 19999)];
    const auto shown = static_cast<double>(trips.Percentile(share).count());
    EXPECT_GE(shown, truth * 0.999) << share;
    EXPECT_LE(shown, truth * 1.2) << share;
  }
}

TEST(RoundTrips, ExtremesStayInTheTable) {
  RoundTrips trips;
  trips.Add(Duration::zero());
  EXPECT_EQ(trips.Percentile(1), 64us);
  trips.Add(24h);
  EXPECT_GE(trips.Percentile(1), 1min);
}

TEST(Names, AreThePublishedOnes) {
  EXPECT_EQ(Name(Outcome::none), "none");
  EXPECT_EQ(Name(Outcome::unexpected), "unexpected");
  EXPECT_EQ(Name(Outcome::line_down), "line_down");
  EXPECT_EQ(static_cast<int>(Outcome::line_down), 9);
  EXPECT_EQ(static_cast<int>(DeviceState::disabled), 4);
  EXPECT_EQ(Name(DeviceState::never_seen), "never seen");
}

}  // namespace
}  // namespace baudgate
