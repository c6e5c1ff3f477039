// When events are written timer.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/events/event_log.h"

namespace baudgate::events {
namespace {

constexpr Instant kNow = Instant() + 1h;

TEST(RoundTimerTest, WaitsOnlyForADiskThatFailsOrForWork) {
  RoundTimer timer;
  EXPECT_EQ(timer.At(false, true, {}), kWhenWoken);
  EXPECT_LE(timer.At(false, false, {}), kNow) << "there is work";
  timer.Rest(kNow + 1s);
  EXPECT_EQ(timer.At(true, false, {}), kNow + 1s) << "the disk is left in peace";
  EXPECT_LE(timer.At(false, false, {}), kNow) << "it works again";
}

TEST(RoundTimerTest, TheEarliestLookCounts) {
  RoundTimer timer;
  timer.Look(kNow + 2s);
  timer.Look(kNow + 1s);
  timer.Look(kNow + 3s);
  EXPECT_EQ(timer.At(false, true, {}), kNow + 1s);
  EXPECT_EQ(timer.At(false, true, kNow + 500ms), kNow + 500ms) << "what was left out is told first";
  timer.Begin();
  EXPECT_EQ(timer.At(false, true, kNow + 4s), kNow + 4s);
}

}  // namespace
}  // namespace baudgate::events
