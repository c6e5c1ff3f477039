// Folding of log texts that come again: what is held back, and when and in which order it is told.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/chrono.h>
#include <gtest/gtest.h>

#include "gateway/base/log_outlet.h"

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

/// A line that is written late must not read as news.
TEST(LogFolder, ARepeatSaysWhenItCame) {
  const auto local = [](Duration since) {
    const std::time_t time = std::chrono::system_clock::to_time_t(
        std::chrono::time_point_cast<std::chrono::system_clock::duration>(At(since).wall));
    return fmt::format("{:%H:%M:%S}", fmt::localtime(time));
  };
  Folder folder;
  for (const Duration at : {0s, 5s, 30s, 58s}) folder.Pass("offline", Level::warning, At(at));
  folder.Pass("online", Level::info, At(6s));
  folder.Pass("online", Level::info, At(31s));
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 2U);
  EXPECT_EQ(RepeatText(due[0]), "once more at " + local(31s) + ": online");
  EXPECT_EQ(RepeatText(due[1]),
            "3 times more between " + local(5s) + " and " + local(58s) + ": offline");
  for (const Duration at : {70s, 80s}) folder.Pass("offline", Level::warning, At(at));
  const auto next = folder.Due(At(120s).instant);
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0].first.instant, At(70s).instant) << "each count has its own times";
}

TEST(LogFolder, AtTheEndEverythingIsTold) {
  Folder folder;
  folder.Pass("a: offline", Level::warning, At(0s));
  folder.Pass("a: online", Level::info, At(1s));
  folder.Pass("a: online", Level::info, At(2s));
  folder.Pass("a: offline", Level::warning, At(3s));
  const auto all = folder.All(At(4s).instant);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].text, "a: online");
  EXPECT_EQ(all[1].text, "a: offline") << "the true state";
  EXPECT_TRUE(folder.All(At(4s).instant).empty()) << "told once";
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

TEST(LogFolder, TextsWithTheSameKeyAreRepeats) {
  Folder folder;
  EXPECT_TRUE(folder.Pass("10.0.0.7", "10.0.0.7:40112 refused", Level::warning, At(0s)));
  EXPECT_FALSE(folder.Pass("10.0.0.7", "10.0.0.7:40113 refused", Level::warning, At(1s)));
  EXPECT_FALSE(folder.Pass("10.0.0.7", "10.0.0.7:40114 refused", Level::warning, At(2s)));
  EXPECT_TRUE(folder.Pass("10.0.0.8", "10.0.0.8:40112 refused", Level::warning, At(3s)));
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0].text, "10.0.0.7:40114 refused");
  EXPECT_EQ(due[0].times, 2);
}

TEST(LogFolder, KeysWithoutEndTakeBoundedMemoryAndLines) {
  Folder folder;
  constexpr int kStrangers = 10'000;
  int written = 0;
  for (int i = 0; i < kStrangers; ++i) {
    const std::string stranger = "stranger " + std::to_string(i);
    if (folder.Pass(stranger, stranger + " refused", Level::warning, At(0s))) ++written;
  }
  EXPECT_LE(written, 129);
  const auto due = folder.Due(At(60s).instant);
  ASSERT_EQ(due.size(), 1U) << "those that are too many are told together";
  EXPECT_EQ(due[0].text, "stranger 9999 refused");
  EXPECT_EQ(due[0].times, kStrangers - written);
}

TEST(LogFolder, KeysWithoutEndTakeNoRoomFromTexts) {
  Folder folder;
  for (int i = 0; i < 10'000; ++i) {
    folder.Pass("stranger " + std::to_string(i), "refused", Level::warning, At(0s));
  }
  EXPECT_TRUE(folder.Pass("offline", Level::warning, At(1s)));
  EXPECT_FALSE(folder.Pass("offline", Level::warning, At(2s)));
}

TEST(LogFolder, ATextForWhichThereIsNoRoomIsWritten) {
  Folder folder;
  for (int i = 0; i < 256; ++i) {
    folder.Pass("text " + std::to_string(i), Level::info, At(0s));
    folder.Pass("text " + std::to_string(i), Level::info, At(1s));
  }
  EXPECT_TRUE(folder.Pass("one more", Level::info, At(2s)));
  EXPECT_TRUE(folder.Pass("one more", Level::info, At(3s)));
  EXPECT_EQ(folder.Due(At(60s).instant).size(), 256U) << "nothing was forgotten for it";
  folder.Pass("one more", Level::info, At(200s));
  EXPECT_FALSE(folder.Pass("one more", Level::info, At(201s)));
}

}  // namespace
}  // namespace baudgate::log
