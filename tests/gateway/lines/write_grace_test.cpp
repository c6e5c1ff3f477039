// What waits for the end of a write.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/lines/line_port.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

TEST(WriteGraceTest, TheLastThatWaitsHappensOnce) {
  std::string done;
  WriteGrace grace;
  EXPECT_FALSE(grace.waits());
  EXPECT_FALSE(grace.IsOver(kStart));
  grace.Begin([&] { done += "release "; }, kStart);
  grace.Begin([&] { done += "stop "; }, kStart + 500ms);
  EXPECT_TRUE(grace.waits());
  EXPECT_EQ(grace.until(), kStart + 1500ms);
  EXPECT_FALSE(grace.IsOver(kStart + 1499ms));
  EXPECT_TRUE(grace.IsOver(kStart + 1500ms));
  grace.End();
  EXPECT_EQ(done, "stop ");
  EXPECT_FALSE(grace.waits());
  EXPECT_FALSE(grace.IsOver(kStart + 1h));
}

TEST(WriteGraceTest, WhatFollowsMayWaitAgain) {
  int ends = 0;
  WriteGrace grace;
  grace.Begin([&] { grace.Begin([&] { ++ends; }, kStart + 1s); }, kStart);
  grace.End();
  EXPECT_EQ(ends, 0);
  ASSERT_TRUE(grace.waits());
  grace.End();
  EXPECT_EQ(ends, 1);
}

}  // namespace
}  // namespace baudgate
