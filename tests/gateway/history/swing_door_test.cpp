// Lines in place of readings: what is left out lies within the deadband of them, whatever comes.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/history/swing_door.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace baudgate::history {
namespace {

using ::testing::ElementsAre;

constexpr Millis kStart = 500'000 * kHour;

Entry At(Millis time, double value, Quality quality = Quality::good) {
  return {kStart + time, IsBad(quality) ? Value() : Value(value), quality};
}

std::vector<Entry> Kept(SwingDoor& door, const std::vector<Entry>& readings) {
  std::vector<Entry> kept;
  for (const Entry& reading : readings) {
    for (const Entry& one : door.Take(reading)) kept.push_back(one);
  }
  if (const auto last = door.End()) kept.push_back(*last);
  return kept;
}

std::vector<Millis> TimesOf(const std::vector<Entry>& entries) {
  std::vector<Millis> times;
  for (const Entry& entry : entries) times.push_back(entry.time - kStart);
  return times;
}

TEST(SwingDoor, KeepsTheEndsOfALine) {
  SwingDoor door(1, kHour);
  EXPECT_THAT(TimesOf(Kept(door, {At(0, 0), At(1, 1), At(2, 2), At(3, 3), At(4, 9), At(5, 9)})),
              ElementsAre(0, 3, 4, 5));
}

TEST(SwingDoor, KeepsAQualityThatChangesAndWhatWasBeforeIt) {
  SwingDoor door(1, kHour);
  EXPECT_THAT(TimesOf(Kept(door, {At(0, 0), At(1, 0), At(2, 0, Quality::bad_communication),
                                  At(3, 0, Quality::bad_communication), At(4, 0), At(5, 0)})),
              ElementsAre(0, 1, 2, 4, 5));
}

TEST(SwingDoor, DoesNotWaitBeyondAnHour) {
  SwingDoor door(1, 24 * kHour);
  EXPECT_THAT(TimesOf(Kept(door, {At(0, 0), At(kHour - 1000, 0), At(kHour + 1000, 0)})),
              ElementsAre(0, kHour - 1000, kHour + 1000));
}

/// What a reader makes of it; the oracle.
double Reconstructed(const std::vector<Entry>& kept, Millis time) {
  const auto after = std::ranges::lower_bound(kept, time, {}, &Entry::time);
  if (after->time == time) return ToDouble(after->value);
  const Entry& before = *(after - 1);
  const double share =
      static_cast<double>(time - before.time) / static_cast<double>(after->time - before.time);
  return ToDouble(before.value) + share * (ToDouble(after->value) - ToDouble(before.value));
}

struct World {
  std::vector<Entry> readings;
  double deadband = 0;
  Millis max_gap = 0;
};

/// Ramps, noise, steps, spikes and rests; qualities that flap; readings that come as they like.
World RandomWorld(std::mt19937_64& random) {
  const auto below = [&](std::uint64_t n) { return random() % n; };
  World world;
  world.deadband = std::pow(10.0, static_cast<double>(below(6)) - 3.0);
  world.max_gap = static_cast<Millis>(1 + below(600)) * kSecond;
  std::normal_distribution<double> noise(0, world.deadband);
  Millis time = static_cast<Millis>(below(1'000'000));
  double value = 0;
  double slope = 0;
  Quality quality = Quality::good;
  for (int i = 0; i < 400; ++i) {
    time += static_cast<Millis>(1 + below(below(10) == 0 ? 900'000 : 2'000));
    if (below(20) == 0) slope = noise(random) * static_cast<double>(below(4));
    if (below(30) == 0) value += noise(random) * 1000;
    value += slope;
    const std::uint64_t what = below(60);
    if (what == 0) quality = Quality::bad_communication;
    if (what == 1) quality = Quality::uncertain;
    if (what > 40) quality = Quality::good;
    world.readings.push_back(At(time, value + (below(2) == 0 ? noise(random) : 0), quality));
  }
  return world;
}

TEST(SwingDoor, NeverLeavesTheDeadbandNorAQualityNorTheGap) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    std::mt19937_64 random(seed);
    const World world = RandomWorld(random);
    SwingDoor door(world.deadband, world.max_gap);
    const std::vector<Entry> kept = Kept(door, world.readings);
    ASSERT_TRUE(std::ranges::is_sorted(kept, {}, &Entry::time)) << seed;
    ASSERT_EQ(kept.front(), world.readings.front());
    ASSERT_EQ(kept.back().quality, world.readings.back().quality) << seed;
    for (std::size_t i = 0; i < world.readings.size(); ++i) {
      const Entry& reading = world.readings[i];
      const auto is_this = [&](const Entry& one) { return one == reading; };
      const bool is_kept = std::ranges::any_of(kept, is_this);
      const bool changes = i == 0 || world.readings[i - 1].quality != reading.quality;
      ASSERT_TRUE(is_kept || !changes) << "seed " << seed << ", reading " << i;
      const auto after = std::ranges::lower_bound(kept, reading.time, {}, &Entry::time);
      if (is_kept || !HasValue(reading.value)) continue;
      ASSERT_NE(after, kept.end()) << "seed " << seed << ", reading " << i;
      ASSERT_EQ(after->quality, reading.quality) << "seed " << seed << ", reading " << i;
      ASSERT_EQ((after - 1)->quality, reading.quality) << "seed " << seed << ", reading " << i;
      const double rounding = 1e-9 * (std::abs(ToDouble(reading.value)) + world.deadband);
      ASSERT_NEAR(Reconstructed(kept, reading.time), ToDouble(reading.value),
                  world.deadband + rounding)
          << "seed " << seed << ", reading " << i;
    }
    for (std::size_t i = 1; i < kept.size(); ++i) {
      // Between two that are kept lies no reading that max_gap would have had.
      const auto late = [&](const Entry& reading) {
        return reading.time >= kept[i - 1].time + world.max_gap && reading.time < kept[i].time;
      };
      ASSERT_TRUE(std::ranges::none_of(world.readings, late)) << "seed " << seed << ", " << i;
    }
    ASSERT_LE(kept.size(), world.readings.size());
  }
}

TEST(SwingDoor, KeepsLessThanADeadbandOfARamp) {
  SwingDoor door(0.5, kHour);
  std::vector<Entry> ramp;
  for (int i = 0; i < 1000; ++i) ramp.push_back(At(i * 1000, i * 0.1));
  EXPECT_EQ(Kept(door, ramp).size(), 2U);
}

}  // namespace
}  // namespace baudgate::history
