// What the publisher sends and when: deadband, quality, heartbeat, pace; time is made here.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/publish_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

PointState Number(double value, Quality quality = Quality::good) {
  return PointState::Of(value, quality);
}

/// One point with a deadband, already sent with `value`.
PublishPlan SentSample(double value, double deadband = 0) {
  PublishPlan plan({}, {deadband}, 0, kStart);
  plan.PointSent(0, Number(value), kStart);
  return plan;
}

TEST(PublishPlan, WantsEveryPointAtFirst) {
  PublishPlan plan({}, {0, 5}, 1, kStart);
  EXPECT_TRUE(plan.WantsPoint(0, Number(0, Quality::bad_waiting)));
  EXPECT_TRUE(plan.WantsPoint(1, PointState::Of(Value(), Quality::bad_waiting)));
  EXPECT_FALSE(plan.WasSent(0));
  plan.PointSent(0, Number(0), kStart);
  EXPECT_TRUE(plan.WasSent(0));
}

TEST(PublishPlan, RepeatsNothingThatHasNotChanged) {
  EXPECT_FALSE(SentSample(1.5).WantsPoint(0, Number(1.5)));
  EXPECT_TRUE(SentSample(1.5).WantsPoint(0, Number(std::nextafter(1.5, 2))));
}

TEST(PublishPlan, KeepsSmallChangesBack) {
  const PublishPlan plan = SentSample(10, 0.5);
  EXPECT_FALSE(plan.WantsPoint(0, Number(10.5)));
  EXPECT_FALSE(plan.WantsPoint(0, Number(9.5)));
  EXPECT_TRUE(plan.WantsPoint(0, Number(10.51)));
  EXPECT_TRUE(plan.WantsPoint(0, Number(9.49)));
}

TEST(PublishPlan, MeasuresTheDeadbandFromWhatWasSent) {
  PublishPlan plan = SentSample(10, 0.5);
  EXPECT_FALSE(plan.WantsPoint(0, Number(10.3)));
  EXPECT_TRUE(plan.WantsPoint(0, Number(10.6)));  // crept there in two small steps
}

TEST(PublishPlan, SendsAChangeOfQualityWhateverTheDeadband) {
  const PublishPlan plan = SentSample(10, 1000);
  EXPECT_TRUE(plan.WantsPoint(0, Number(10, Quality::uncertain_last_usable)));
  EXPECT_TRUE(plan.WantsPoint(0, Number(10, Quality::bad_communication)));
}

TEST(PublishPlan, ComparesNaNAndInfinity) {
  EXPECT_FALSE(SentSample(kNan).WantsPoint(0, Number(kNan)));
  EXPECT_TRUE(SentSample(kNan, 5).WantsPoint(0, Number(0)));
  EXPECT_TRUE(SentSample(0, 5).WantsPoint(0, Number(kNan)));
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(SentSample(kInfinite, 5).WantsPoint(0, Number(kInfinite)));
  EXPECT_TRUE(SentSample(kInfinite, 5).WantsPoint(0, Number(-kInfinite)));
  EXPECT_TRUE(SentSample(kInfinite, 5).WantsPoint(0, Number(1)));
}

TEST(PublishPlan, SeesChangedText) {
  PublishPlan plan({}, {100}, 0, kStart);
  plan.PointSent(0, PointState::Of(std::string("SPCJ 4D29"), Quality::good), kStart);
  EXPECT_FALSE(plan.WantsPoint(0, PointState::Of(std::string("SPCJ 4D29"), Quality::good)));
  EXPECT_TRUE(plan.WantsPoint(0, PointState::Of(std::string("SPCJ 4D28"), Quality::good)));
}

TEST(PublishPlan, TheImageComesInPortions) {
  PublishPlan plan({}, std::vector<double>(100, 0), 0, kStart);
  std::vector<std::uint32_t> due;
  std::vector<bool> seen(100, false);
  for (std::size_t left = 100; left > 0;) {
    plan.TakeDuePoints(kStart, 30, due);
    ASSERT_EQ(due.size(), std::min<std::size_t>(30, left));
    left -= due.size();
    for (const auto slot : due) {
      ASSERT_FALSE(seen[slot]);
      seen[slot] = true;
      plan.PointSent(slot, Number(0), kStart);
    }
  }
  plan.TakeDuePoints(kStart, 30, due);
  EXPECT_TRUE(due.empty());
}

TEST(PublishPlan, SendsAnUnchangedPointWithinTheHeartbeat) {
  PublishPlan plan({.heartbeat = 10s}, std::vector<double>(1000, 0), 0, kStart);
  std::map<std::uint32_t, Instant> last;
  for (std::uint32_t slot = 0; slot < 1000; ++slot) {
    plan.PointSent(slot, Number(1), kStart);
    last[slot] = kStart;
  }
  std::vector<std::uint32_t> due;
  std::size_t most_at_once = 0;
  for (Instant now = kStart; now < kStart + 60s; now += 10ms) {
    plan.TakeDuePoints(now, 1000, due);
    most_at_once = std::max(most_at_once, due.size());
    for (const auto slot : due) {
      ASSERT_TRUE(plan.WantsPoint(slot, Number(1)));
      ASSERT_LE(now - last[slot], 10s + 10ms);
      ASSERT_GE(now - last[slot], 7s);
      plan.PointSent(slot, Number(1), now);
      last[slot] = now;
    }
  }
  for (const auto& [slot, at] : last) EXPECT_GE(at, kStart + 49s) << slot;
  // All were sent in one moment at the start; their heartbeats must not be.
  EXPECT_LE(most_at_once, 12U);
}

TEST(PublishPlan, AChangePutsTheHeartbeatOff) {
  PublishPlan plan = SentSample(1);
  std::vector<std::uint32_t> due;
  for (int second = 1; second <= 30; ++second) {
    plan.PointSent(0, Number(second), kStart + std::chrono::seconds(second));
    plan.TakeDuePoints(kStart + std::chrono::seconds(second), 10, due);
    EXPECT_TRUE(due.empty()) << second;
  }
}

TEST(PublishPlan, TriesAgainAfterAFailedWrite) {
  PublishPlan plan = SentSample(1);
  ASSERT_TRUE(plan.WantsPoint(0, Number(2)));
  plan.PointFailed(0, kStart + 2s);
  std::vector<std::uint32_t> due;
  plan.TakeDuePoints(kStart + 2900ms, 10, due);
  EXPECT_TRUE(due.empty());
  plan.TakeDuePoints(kStart + 3s, 10, due);
  EXPECT_EQ(due, std::vector<std::uint32_t>{0});
  EXPECT_TRUE(plan.WantsPoint(0, Number(1)));  // even when it has changed back
}

TEST(PublishPlan, ADeviceIsSentOnceASecond) {
  PublishPlan plan({}, {}, 1, kStart);
  ASSERT_TRUE(plan.WantsDevice(0, DeviceState::online, kStart));
  plan.DeviceSent(0, DeviceState::online, kStart);
  EXPECT_FALSE(plan.WantsDevice(0, DeviceState::online, kStart + 300ms));
  EXPECT_LE(plan.NextDue(), kStart + 1s);
  std::vector<std::uint32_t> due;
  plan.TakeDueDevices(kStart + 999ms, 10, due);
  EXPECT_TRUE(due.empty());
  plan.TakeDueDevices(kStart + 1s, 10, due);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_TRUE(plan.WantsDevice(0, DeviceState::online, kStart + 1s));
}

TEST(PublishPlan, AChangeOfStateGoesOutAtOnce) {
  PublishPlan plan({}, {}, 1, kStart);
  plan.DeviceSent(0, DeviceState::online, kStart);
  EXPECT_TRUE(plan.WantsDevice(0, DeviceState::offline, kStart + 1ms));
}

TEST(PublishPlan, ADeviceHasAHeartbeatToo) {
  PublishPlan plan({.heartbeat = 10s}, {}, 1, kStart);
  plan.DeviceSent(0, DeviceState::online, kStart);
  std::vector<std::uint32_t> due;
  plan.TakeDueDevices(kStart + 7s, 10, due);
  EXPECT_TRUE(due.empty());
  plan.TakeDueDevices(kStart + 10s, 10, due);
  EXPECT_EQ(due.size(), 1U);
}

}  // namespace
}  // namespace baudgate::dds
