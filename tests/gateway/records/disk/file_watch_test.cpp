// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/disk/disk.h"

namespace baudgate {
namespace {

TEST(FileWatch, LooksAgainAndAgain) {
  FileWatch watch;
  for (int round = 0; round < 3; ++round) {
    for (int tick = 1; tick < FileWatch::kLookEvery; ++tick) watch.Tick(false);
    EXPECT_FALSE(watch.look_due());
    watch.Tick(false);
    EXPECT_TRUE(watch.look_due());
    watch.Tick(false);
    EXPECT_TRUE(watch.TakeLook().due);
    EXPECT_FALSE(watch.TakeLook().due);
    for (int tick = 2; tick < FileWatch::kLookEvery; ++tick) watch.Tick(false);
    watch.Tick(false);
    watch.TakeLook();
  }
}

TEST(FileWatch, WhatAReaderHasFoundIsLookedAtOnceAtTheNextLook) {
  FileWatch watch;
  watch.Doubt();
  EXPECT_FALSE(watch.TakeLook().whole);
  for (int tick = 0; tick < FileWatch::kLookEvery; ++tick) watch.Tick(false);
  EXPECT_TRUE(watch.TakeLook().whole);
  for (int tick = 0; tick < FileWatch::kLookEvery; ++tick) watch.Tick(false);
  EXPECT_FALSE(watch.TakeLook().whole);
}

TEST(FileWatch, WhatWaitsOrIsWrittenForTooLongIsLate) {
  FileWatch watch;
  for (int tick = 0; tick < FileWatch::kMostTicks; ++tick) EXPECT_FALSE(watch.Tick(true));
  EXPECT_TRUE(watch.Tick(true));
  watch.Begin();
  EXPECT_TRUE(watch.Tick(false)) << "the look itself hangs";
  watch.End();
  EXPECT_FALSE(watch.Tick(true));
}

}  // namespace
}  // namespace baudgate
