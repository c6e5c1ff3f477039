// One dead device under virtual time: when it is given up, how it is probed, and its return.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/devices/device_health.h"
#include "tests/gateway/bus/poller/poller_fixture.h"

namespace baudgate {
namespace {

TEST(Poller, OfflineByCountAndByTime) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1"}), 100ms)}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1s);
  const Instant died = line.now().instant;
  line.twin(0).manner.dead = true;
  ASSERT_TRUE(line.RunUntil([&] { return line.StatusOf(0).state == DeviceState::offline; }, 30s));
  EXPECT_GE(line.now().instant - died, DeviceHealth::kOfflineTime);
  EXPECT_EQ(line.states[1].to, DeviceState::degraded) << "one change after the other";
  EXPECT_EQ(line.states.back().to, DeviceState::offline);
}

TEST(Poller, NeverSeenDeviceIsProbedOnly) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2", "3"})}), {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  line.RunFor(60s);
  EXPECT_EQ(line.CountSent("?A"), 0U);
  EXPECT_GT(line.CountSent("PA0"), 20U);
  EXPECT_EQ(line.StatusOf(0).retries, 0U);
}

TEST(Poller, ReturnIsPolledAtOnce) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.points[0].group = config::Group::slow;
  device.slow = 1h;
  device.points.push_back(ToyDevice("", "", {"2"}).points[0]);
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  line.RunFor(1min);
  ASSERT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.twin(0).manner.dead = false;
  ASSERT_TRUE(line.RunUntil([&] { return line.twin(0).answered == 1; }, 2s))
      << "probed on an idle line";
  line.RunFor(1200ms);  // the ceiling of an exchange: the probes before might still be answered
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good) << "the slow group as well";
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
  ASSERT_FALSE(line.states.empty());
  EXPECT_EQ(line.states.back().to, DeviceState::online);
}

}  // namespace
}  // namespace baudgate
