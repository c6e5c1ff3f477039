// Online, degraded, offline: by count and by time.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/devices/device_health.h"

#include <gtest/gtest.h>

#include "tests/support/times.h"

namespace baudgate {
namespace {

class DeviceHealthTest : public ::testing::Test {
 protected:
  void Task(Outcome outcome, Duration at) {
    health_.OnExchange(outcome);
    health_.OnTask(outcome, kStart + at);
  }
  DeviceHealth health_;
};

TEST_F(DeviceHealthTest, NeverSeenUntilTheFirstAnswer) {
  EXPECT_EQ(health_.state(), DeviceState::never_seen);
  EXPECT_FALSE(health_.absent()) << "its first poll is no probe";
  Task(Outcome::no_reply, 0s);
  EXPECT_EQ(health_.state(), DeviceState::never_seen);
  EXPECT_TRUE(health_.absent());
  Task(Outcome::ok, 1s);
  EXPECT_EQ(health_.state(), DeviceState::online);
  EXPECT_FALSE(health_.absent());
}

TEST_F(DeviceHealthTest, AnyAnswerProvesLife) {
  for (const Outcome outcome : {Outcome::busy, Outcome::refused, Outcome::unsupported}) {
    health_ = {};
    Task(outcome, 0s);
    EXPECT_EQ(health_.state(), DeviceState::online) << Name(outcome);
  }
}

TEST_F(DeviceHealthTest, NoiseDoesNotProveLife) {
  for (const Outcome outcome : {Outcome::partial, Outcome::corrupt, Outcome::unexpected}) {
    health_ = {};
    Task(outcome, 0s);
    EXPECT_EQ(health_.state(), DeviceState::never_seen) << Name(outcome);
  }
}

TEST_F(DeviceHealthTest, ABurstOfFailuresIsNotEnoughForOffline) {
  Task(Outcome::ok, 0s);
  for (int i = 0; i < 20; ++i) Task(Outcome::no_reply, 1s + i * 10ms);
  EXPECT_EQ(health_.state(), DeviceState::degraded);
  Task(Outcome::no_reply, 2s);
  EXPECT_EQ(health_.state(), DeviceState::offline);
}

TEST_F(DeviceHealthTest, TwoFailuresFarApartAreNotEnoughForOffline) {
  Task(Outcome::ok, 0s);
  Task(Outcome::no_reply, 1min);
  Task(Outcome::no_reply, 10min);
  EXPECT_EQ(health_.state(), DeviceState::degraded);
  Task(Outcome::no_reply, 20min);
  EXPECT_EQ(health_.state(), DeviceState::offline);
}

TEST_F(DeviceHealthTest, AnAnswerBetweenStartsTheCountAnew) {
  Task(Outcome::ok, 0s);
  for (int i = 1; i < 30; ++i) {
    Task(Outcome::no_reply, i * 3s);
    Task(Outcome::no_reply, i * 3s + 1s);
    Task(Outcome::ok, i * 3s + 2s);
    EXPECT_NE(health_.state(), DeviceState::offline);
  }
}

TEST_F(DeviceHealthTest, ReturnIsOnlineAtOnce) {
  Task(Outcome::ok, 0s);
  for (int i = 1; i < 40; ++i) Task(Outcome::no_reply, i * 1s);
  ASSERT_EQ(health_.state(), DeviceState::offline);
  Task(Outcome::ok, 100s);
  EXPECT_EQ(health_.state(), DeviceState::online) << "the failures of its absence are forgotten";
}

TEST_F(DeviceHealthTest, RetriesThatHelpedShowAsDegraded) {
  Task(Outcome::ok, 0s);
  for (int i = 0; i < DeviceHealth::kDegradedCount; ++i) {
    health_.OnExchange(Outcome::corrupt);
    Task(Outcome::ok, 1s);
  }
  EXPECT_EQ(health_.state(), DeviceState::degraded);
  for (int i = 0; i < 32; ++i) Task(Outcome::ok, 2s);
  EXPECT_EQ(health_.state(), DeviceState::online);
}

TEST_F(DeviceHealthTest, ALostPortSaysNothingAboutTheDevice) {
  Task(Outcome::ok, 0s);
  for (int i = 0; i < 50; ++i) Task(Outcome::line_down, i * 1s);
  EXPECT_EQ(health_.state(), DeviceState::online);
}

}  // namespace
}  // namespace baudgate
