// Seconds of a minute become a time: over the borders of minute, hour and year, and what cannot be
// known.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/events/event_record.h"

namespace baudgate::events {
namespace {

using namespace std::chrono;  // NOLINT: dates read like dates

WallTime At(sys_days day, Duration time) { return WallTime(day) + time; }
const sys_days kDay = 2026y / 11 / 23;
const sys_days kNewYear = 2027y / 1 / 1;

std::optional<SaidTime> Seconds(Duration time) { return SaidTime{time, 1min}; }

PlacedTime PlaceOne(Duration said, WallTime received, std::optional<Duration> oldest) {
  return Place({Seconds(said)}, received, oldest).front();
}

struct Case {
  const char* name;
  Duration said;
  WallTime received;
  std::optional<Duration> oldest;
  WallTime time;
  ClockQuality quality;
};

TEST(PlacedTime, IsCompletedFromWhenItWasHeard) {
  using Q = ClockQuality;
  const Case cases[] = {
      {"within the minute", 12'345ms, At(kDay, 10h + 13s), 1s, At(kDay, 10h + 12'345ms), Q::device},
      {"at once", 13s, At(kDay, 10h + 13s), 0s, At(kDay, 10h + 13s), Q::device},
      {"the minute before", 59'900ms, At(kDay, 10h + 5min + 300ms), 1s,
       At(kDay, 10h + 4min + 59'900ms), Q::device},
      {"the hour before", 59'999ms, At(kDay, 10h), 2s, At(kDay, 10h - 1ms), Q::device},
      {"the year before", 59'999ms, At(kNewYear, 1ms), 1s, At(kNewYear, -1ms), Q::device},
      {"its clock is ahead", 13'900ms, At(kDay, 10h + 12s), 1s, At(kDay, 10h + 13'900ms),
       Q::device},
      {"ahead over the minute", 500ms, At(kDay, 10h - 1s), 1s, At(kDay, 10h + 500ms), Q::device},
      {"its clock is behind", 9'100ms, At(kDay, 10h + 12s), 1s, At(kDay, 10h + 9'100ms), Q::device},
      {"too far ahead", 15s, At(kDay, 10h + 12s), 1s, At(kDay, 10h - 45s), Q::out_of_step},
      {"too far behind", 5s, At(kDay, 10h + 12s), 1s, At(kDay, 10h + 5s), Q::out_of_step},
      {"half a minute away", 42s, At(kDay, 10h + 12s), 1s, At(kDay, 10h - 18s), Q::out_of_step},
      {"asked after 50 s", 20s, At(kDay, 10h + 12s), 53s, At(kDay, 10h - 40s), Q::device},
      {"asked after a minute", 10s, At(kDay, 10h + 12s), 61s, At(kDay, 10h + 10s),
       Q::minute_guessed},
      {"asked after a minute, and but one fits", 40s, At(kDay, 10h + 12s), 61s, At(kDay, 10h - 20s),
       Q::device},
      {"after a start", 10s, At(kDay, 10h + 12s), std::nullopt, At(kDay, 10h + 10s),
       Q::minute_guessed},
      {"before 1970", 59s, WallTime(Duration(30s)), 40s, WallTime(Duration(-1s)), Q::device},
  };
  for (const Case& one : cases) {
    const PlacedTime placed = PlaceOne(one.said, one.received, one.oldest);
    EXPECT_EQ(FormatWallTime(placed.time), FormatWallTime(one.time)) << one.name;
    EXPECT_EQ(placed.time, one.time) << one.name;
    EXPECT_EQ(Name(placed.quality), Name(one.quality)) << one.name;
  }
}

/// An event between two looks of 1 s, and up to 2 s until the reply is through.
TEST(PlacedTime, IsRightForEveryDelayOfTwoSeconds) {
  for (const WallTime border : {At(kDay, 10h), At(kDay, 10h + 1min), At(kNewYear, 0s)}) {
    for (Duration before = -61s; before <= 61s; before += 97ms) {
      for (const Duration delay : {0ms, 1ms, 300ms, 999ms, 2'000ms}) {
        const WallTime happened = border + before;
        const Duration said = happened.time_since_epoch() % 1min;
        const PlacedTime placed = PlaceOne(said, happened + delay, delay + 1s);
        ASSERT_EQ(placed.time, happened) << before.count() << " " << delay.count();
        ASSERT_EQ(placed.quality, ClockQuality::device);
      }
    }
  }
}

TEST(PlacedTime, OfABatchKeepsItsOrder) {
  // 59.900 came before 00.100, so that it is not of the minute that has just begun.
  const auto placed =
      Place({Seconds(59'900ms), Seconds(100ms), Seconds(100ms)}, At(kDay, 10h + 58s), {});
  EXPECT_EQ(placed[0].time, At(kDay, 10h - 100ms));
  EXPECT_EQ(placed[1].time, At(kDay, 10h + 100ms));
  EXPECT_EQ(placed[2].time, At(kDay, 10h + 100ms));
  // Over several minutes: 30, 20, 10 took two of them at least.
  const auto long_ago = Place({Seconds(30s), Seconds(20s), Seconds(10s)}, At(kDay, 10h + 12s), {});
  EXPECT_EQ(long_ago[0].time, At(kDay, 10h - 90s));
  EXPECT_EQ(long_ago[1].time, At(kDay, 10h - 40s));
  EXPECT_EQ(long_ago[2].time, At(kDay, 10h + 10s));
  EXPECT_EQ(long_ago[0].quality, ClockQuality::minute_guessed);
  // A clock that is set back by a second does not make an event a minute older.
  const auto set_back = Place({Seconds(11s), Seconds(10s)}, At(kDay, 10h + 12s), 3s);
  EXPECT_EQ(set_back[0].time, At(kDay, 10h + 11s));
  EXPECT_EQ(set_back[1].time, At(kDay, 10h + 10s));
}

TEST(PlacedTime, OfNothingSaidIsWhenItWasHeard) {
  const auto placed = Place({std::nullopt, Seconds(11s)}, At(kDay, 10h + 12s), 3s);
  EXPECT_EQ(placed[0].time, At(kDay, 10h + 12s));
  EXPECT_EQ(placed[0].quality, ClockQuality::none);
  EXPECT_EQ(placed[1].quality, ClockQuality::device);
}

TEST(PlacedTime, OfAWholeDateIsThatDate) {
  const WallTime date = At(kDay, 9h);
  const auto placed = Place({SaidTime{date.time_since_epoch(), {}}}, At(kDay, 10h), 1s);
  EXPECT_EQ(placed[0].time, date);
  EXPECT_EQ(placed[0].quality, ClockQuality::device);
}

}  // namespace
}  // namespace baudgate::events
