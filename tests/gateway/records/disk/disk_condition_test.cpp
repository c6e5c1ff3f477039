// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/disk/disk.h"

namespace baudgate {
namespace {

struct ShownDisk {
  Disk disk = Disk::opening;
  std::string trouble;
  WallTime since{};
};

TEST(DiskCondition, ATroubleIsToldOnceAndItsEndOnce) {
  const WallTime start(1000s);
  DiskCondition disk(start);
  struct Row {
    Disk disk;
    std::string trouble;
    bool begun;
    std::string ended;
  };
  const Row rows[] = {
      {Disk::fine, "", false, ""},        {Disk::stalled, "late", true, ""},
      {Disk::stalled, "late", false, ""}, {Disk::failing, "full", false, ""},
      {Disk::fine, "", false, "full"},    {Disk::fine, "", false, ""},
      {Disk::failing, "gone", true, ""},  {Disk::fine, "", false, "gone"},
  };
  WallTime now = start;
  for (const Row& row : rows) {
    now += 1s;
    const DiskCondition::News news = disk.Set(row.disk, row.trouble, now);
    EXPECT_EQ(news.begun, row.begun) << row.trouble;
    EXPECT_EQ(news.ended ? news.ended->trouble : std::string(), row.ended);
    ShownDisk state;
    disk.Fill(state);
    EXPECT_EQ(state.disk, row.disk);
    EXPECT_EQ(disk.trouble(), row.trouble);
  }
}

TEST(DiskCondition, SinceIsThatOfTheDiskAsItIs) {
  ShownDisk state;
  DiskCondition disk(WallTime(1s));
  disk.Set(Disk::failing, "full", WallTime(2s));
  disk.Set(Disk::failing, "gone", WallTime(3s));
  disk.Fill(state);
  EXPECT_EQ(state.since, WallTime(2s));
  EXPECT_EQ(state.trouble, "gone");
  const auto news = disk.Set(Disk::fine, "", WallTime(4s));
  ASSERT_TRUE(news.ended);
  EXPECT_EQ(news.ended->since, WallTime(2s));
}

}  // namespace
}  // namespace baudgate
