// Since when a line is idle.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/schedule/turns.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class IdleTimeTest : public ::testing::Test {
 protected:
  /// An input: was the line idle before it, and is it afterwards?
  Duration Input(Duration at, bool before, bool after) {
    const Duration passed = time_.OnInput({kStart + at, kWall + at}, before);
    time_.OnHandled(after);
    return passed;
  }
  Duration Since() const { return time_.idle().since - kStart; }

  IdleTime time_;
};

TEST_F(IdleTimeTest, BeginsWithTheInputThatMadeTheLineIdle) {
  Input(1s, false, false);
  EXPECT_EQ(Input(3s, false, true), 2s);
  EXPECT_EQ(Since(), 3s);
  EXPECT_EQ(Input(8s, true, true), 5s);
  EXPECT_EQ(Since(), 3s) << "it is idle still";
  EXPECT_EQ(time_.idle().now, kStart + 8s);
  Input(9s, true, false);
  Input(10s, false, true);
  EXPECT_EQ(Since(), 10s);
}

TEST_F(IdleTimeTest, BeginsAnewWhenTheLineGoesOn) {
  Input(1s, false, true);
  Input(5s, true, true);
  time_.Restart();
  EXPECT_EQ(Since(), 5s);
}

}  // namespace
}  // namespace baudgate
