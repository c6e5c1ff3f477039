// The last hour of a device: counted in minutes, and what is older is forgotten.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/points/device_status.h"

namespace baudgate {
namespace {

TEST(LastHour, ForgetsWhatIsOlder) {
  LastHour hour;
  const Instant start = Instant() + 100h;
  for (int minute = 0; minute < 90; ++minute) {
    MinuteCounts& counts = hour.At(start + minute * 1min);
    ++counts.answered;
    counts.up += 45s;
    counts.down += 15s;
  }
  const Instant now = start + 89min;
  EXPECT_EQ(hour.Sum(now).answered, 60U);
  EXPECT_EQ(hour.Sum(now, 4).answered, 5U) << "the minute under way and four full ones";
  EXPECT_EQ(hour.Sum(now + 30min).answered, 30U);
  EXPECT_EQ(hour.Sum(now + 2h).answered, 0U);
  EXPECT_DOUBLE_EQ(Availability(hour.Sum(now)), 0.75);
  EXPECT_DOUBLE_EQ(Availability({}), 1);
}

TEST(LastHour, HasEachOfItsMinutes) {
  LastHour hour;
  const Instant start = Instant() + 100h;
  hour.At(start).up = 60s;
  hour.At(start + 59min).down = 20s;
  const auto all = hour.All(start + 59min);
  EXPECT_EQ(all.front().up, 60s);
  EXPECT_EQ(all.back().down, 20s);
  EXPECT_EQ(all[1].up + all[1].down, 0s);
  EXPECT_EQ(hour.All(start + 60min).front().up, 0s) << "it is over";
  EXPECT_EQ(hour.All(start + 60min)[58].down, 20s);
}

}  // namespace
}  // namespace baudgate
