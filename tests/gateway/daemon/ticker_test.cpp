// Test of `Ticker`: values age even if no output reads them.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/ticker.h"

#include <gtest/gtest.h>

#include "gateway/bus/points/point_store.h"

namespace baudgate::daemon {
namespace {

config::Config OnePoint() {
  config::Config config;
  config.lines.emplace_back();
  config.lines[0].devices.emplace_back();
  config.lines[0].devices[0].max_age = 1ns;
  config.lines[0].devices[0].points.emplace_back();
  return config;
}

TEST(Ticker, AgedValuesReachTheFeeds) {
  const config::Config config = OnePoint();
  bus::PointStore store(config);
  const auto feed = store.Subscribe();
  const std::vector<bus::Sample> samples = {{0, Value(1.0), Quality::good}};
  Now long_ago = ReadClocks();
  long_ago.instant -= 1h;
  store.Update(0, samples, long_ago, 1ms);
  bus::Changes changes;
  feed->Drain(Instant{}, changes);
  ASSERT_EQ(changes.points.size(), 1U);

  asio::io_context io;
  int told = 0;
  Ticker ageing(io, [&](Instant now) {
    store.Age(now);
    if (++told == 2) io.stop();
  });
  ageing.Start();
  io.run();
  EXPECT_EQ(told, 2) << "again and again";
  feed->Drain(Instant{}, changes);
  ASSERT_EQ(changes.points.size(), 1U);
  EXPECT_EQ(changes.points[0].device, 0U);
}

}  // namespace
}  // namespace baudgate::daemon
