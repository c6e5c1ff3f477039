// The feed of changes: coalescing, bounded, and woken at once.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <thread>
#include <vector>

#include "gateway/bus/points/point_store.h"

namespace baudgate {
namespace {

class ChangeFeedTest : public ::testing::Test {
 protected:
  void Mark(std::uint32_t device, std::vector<std::uint32_t> points) {
    feed_.MarkPoints(device, points);
  }
  Changes Drain() {
    Changes changes;
    feed_.Drain(Instant(), changes);
    return changes;
  }

  static constexpr std::array<std::size_t, 2> kCounts = {3, 1};
  ChangeFeed feed_{kCounts};
};

TEST_F(ChangeFeedTest, NothingPendingIsEmpty) { EXPECT_TRUE(Drain().empty()); }

TEST_F(ChangeFeedTest, RepeatedChangesCoalesce) {
  for (int i = 0; i < 100'000; ++i) {
    Mark(0, {0, 2});
    Mark(1, {0});
    feed_.MarkDevice(1);
  }
  const Changes changes = Drain();
  EXPECT_EQ(changes.points.size(), 3U) << "never more than there are points";
  EXPECT_EQ(changes.devices, std::vector<std::uint32_t>{1});
  EXPECT_TRUE(Drain().empty());
}

TEST_F(ChangeFeedTest, AChangeAfterTheDrainIsNewAgain) {
  Mark(0, {1});
  Drain();
  Mark(0, {1});
  feed_.MarkDevice(0);
  const Changes changes = Drain();
  ASSERT_EQ(changes.points.size(), 1U);
  EXPECT_EQ(changes.points[0].device, 0U);
  EXPECT_EQ(changes.points[0].point, 1U);
  EXPECT_EQ(changes.devices.size(), 1U);
}

TEST_F(ChangeFeedTest, WhatTheCallerHeldIsCleared) {
  Changes changes;
  changes.points.resize(7);
  changes.devices.resize(7);
  feed_.Drain(Instant(), changes);
  EXPECT_TRUE(changes.empty());
  Mark(0, {0});
  EXPECT_EQ(Drain().points.size(), 1U) << "an old result came back as pending";
}

TEST_F(ChangeFeedTest, WakeEndsAWaitEvenBeforeItBegins) {
  feed_.Wake();
  Changes changes;
  feed_.Drain(Instant::max(), changes);
  EXPECT_TRUE(changes.empty());
}

TEST_F(ChangeFeedTest, AWaitingDrainHearsOfAChange) {
  std::thread producer([this] { Mark(0, {1}); });
  Changes changes;
  feed_.Drain(Instant::max(), changes);
  producer.join();
  EXPECT_EQ(changes.points.size(), 1U);
}

TEST_F(ChangeFeedTest, NoChangeIsLostBetweenThreads) {
  std::thread producer([this] {
    for (std::uint32_t i = 0; i < 20'000; ++i) Mark(0, {i % 3});
    Mark(1, {0});  // the last word
  });
  bool last_seen = false;
  while (!last_seen) {
    Changes changes;
    feed_.Drain(Instant::max(), changes);
    EXPECT_LE(changes.points.size(), 4U);
    for (const PointRef& ref : changes.points) last_seen = last_seen || ref.device == 1;
  }
  producer.join();
}

}  // namespace
}  // namespace baudgate
