// Folding of log texts that come again: what is held back, and when and in which order it is told.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/log_folder.h"

#include <gtest/gtest.h>

namespace baudgate::log {
namespace {

Now At(Duration since) { return {Instant{} + 1h + since, WallTime{} + 1h + since}; }

TEST(LogFolder, ATextIsHeldBackForAMinute) {
  Folder folder;
  EXPECT_TRUE(folder.Pass("online", Level::info, At(0s)));
  EXPECT_FALSE(folder.Pass("online", Level::info, At(59s)));
  EXPECT_TRUE(folder.Pass("offline", Level::warning, At(59s)));
  EXPECT_TRUE(folder.Pass("online", Level::info, At(61s)));
}

TEST(LogFolder, WhatWasHeldBackIsToldThoughNothingComesAnyMore) {
  Folder folder;
  folder.Pass("offline", Level::warning, At(0s));
  folder.Pass("offline", Level::warning, At(10s));
  folder.Pass("offline", Level::warning, At(20s));
  EXPECT_TRUE(folder.Due(At(59s).instant).empty());
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0].text, "offline");
  EXPECT_EQ(due[0].level, Level::warning);
  EXPECT_EQ(due[0].times, 2);
  EXPECT_EQ(due[0].last.instant, At(20s).instant);
  EXPECT_TRUE(folder.Due(At(200s).instant).empty()) << "told once";
}

TEST(LogFolder, TheLatestIsToldLast) {
  Folder folder;
  folder.Pass("a: offline", Level::warning, At(0s));
  folder.Pass("z: online", Level::info, At(1s));
  folder.Pass("z: online", Level::info, At(20s));
  folder.Pass("a: offline", Level::warning, At(30s));
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 2U);
  EXPECT_EQ(due[0].text, "z: online");
  EXPECT_EQ(due[1].text, "a: offline") << "the log ends with the state in which things are";
}

TEST(LogFolder, ManyTextsTakeBoundedMemory) {
  Folder folder;
  for (int i = 0; i < 10'000; ++i) {
    folder.Pass("text " + std::to_string(i), Level::info, At(0s));
    folder.Pass("text " + std::to_string(i), Level::info, At(1s));
  }
  EXPECT_LE(folder.Due(At(60s).instant).size(), 256U);
}

}  // namespace
}  // namespace baudgate::log
