// Minutes and hours against the definition: the value of every millisecond, looked up.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "gateway/records/history/batch.h"

namespace baudgate::history {
namespace {

struct Set {
  Millis time = 0;
  std::optional<double> value;
  bool reading = true;
};

/// Millisecond by millisecond, in the widest arithmetic there is.
std::map<Millis, Trend> Oracle(const std::vector<Set>& sets, Millis end, Millis width) {
  std::map<Millis, Trend> spans;
  std::map<Millis, long double> sums;
  std::size_t at = 0;
  for (Millis time = sets.front().time; time < end; ++time) {
    const Millis begin = FloorTo(time, width);
    while (at + 1 < sets.size() && sets[at + 1].time <= time) ++at;
    const Set& set = sets[at];
    if (!set.value) continue;
    Trend& span = spans[begin];
    span.begin = begin;
    if (span.good++ == 0) span.first = span.min = span.max = *set.value;
    span.min = std::min(span.min, *set.value);
    span.max = std::max(span.max, *set.value);
    span.last = *set.value;
    if (set.time == time && set.reading) ++span.count;
    sums[begin] += *set.value;
  }
  for (auto& [begin, span] : spans) {
    span.mean = static_cast<double>(sums[begin] / static_cast<long double>(span.good));
  }
  return spans;
}

std::vector<Trend> Rolled(const std::vector<Set>& sets, Millis end, Millis width,
                          std::mt19937& random) {
  std::vector<Trend> out;
  Rollup rollup(width);
  for (const Set& set : sets) {
    rollup.Set(set.time, set.value, set.reading, out);
    // To look at the clock in between changes nothing.
    if (random() % 3 == 0) rollup.Advance(set.time, out);
  }
  rollup.Forget(end, out);
  return out;
}

TEST(Rollup, Example) {
  std::vector<Trend> out;
  Rollup rollup(kMinute);
  rollup.Set(0, 10.0, true, out);
  rollup.Set(30'000, 20.0, true, out);
  rollup.Set(90'000, std::nullopt, true, out);
  rollup.Forget(10 * kMinute, out);
  const std::vector<Trend> wanted = {{0, 15, 10, 20, 10, 20, 2, 60'000},
                                     {60'000, 20, 20, 20, 20, 20, 0, 30'000}};
  EXPECT_EQ(out, wanted);
}

TEST(Rollup, NoSumOverflows) {
  constexpr double kMost = std::numeric_limits<double>::max();
  std::vector<Trend> out;
  Rollup rollup(kMinute);
  rollup.Set(0, -kMost, true, out);
  rollup.Set(15 * kSecond, kMost, true, out);
  rollup.Set(kMinute, 1e308, true, out);
  rollup.Set(kMinute + 15 * kSecond, 1e22, true, out);
  rollup.Set(2 * kMinute, 5e-324, true, out);
  rollup.Forget(3 * kMinute, out);
  ASSERT_EQ(out.size(), 3U);
  EXPECT_DOUBLE_EQ(out[0].mean, kMost / 2);
  EXPECT_DOUBLE_EQ(out[1].mean, 0.25e308);
  EXPECT_EQ(out[2].mean, 5e-324);
  Trend both{0, -kMost, -kMost, -kMost, -kMost, -kMost, 1, kMinute};
  Merge(both, {0, kMost, kMost, kMost, kMost, kMost, 1, 3 * kMinute});
  EXPECT_DOUBLE_EQ(both.mean, kMost / 2);
  Merge(both, {0, kMost, kMost, kMost, kMost, kMost, 1, kMinute});
  EXPECT_DOUBLE_EQ(both.mean, kMost / 5 * 3);
}

TEST(Rollup, EqualsTheOracle) {
  std::mt19937 random(14);
  for (int round = 0; round < 400; ++round) {
    const Millis width = 20 + random() % 100;
    std::vector<Set> sets;
    // Many times fall on a boundary, or just beside it.
    Millis time = 1'790'000'000'000 + random() % 200;
    const double offset = random() % 2 == 0 ? 0 : 1e6;
    for (std::size_t i = 1 + random() % 40; i > 0; --i) {
      Set set{time, std::nullopt, random() % 4 != 0};
      if (random() % 5 != 0) set.value = offset + static_cast<double>(random() % 1000) / 7.0;
      if (random() % 50 == 0) set.value = NAN;
      sets.push_back(set);
      const Millis step = 1 + random() % (random() % 8 == 0 ? 500 : 40);
      time = random() % 3 == 0 ? FloorTo(time + step, width) + random() % 2 : time + step;
      if (time <= sets.back().time) time = sets.back().time + 1;
    }
    const std::vector<Trend> rolled = Rolled(sets, time, width, random);
    for (Set& set : sets) {
      if (set.value && std::isnan(*set.value)) set.value.reset();
    }
    const auto wanted = Oracle(sets, time, width);
    ASSERT_EQ(rolled.size(), wanted.size()) << "round " << round;
    for (const Trend& trend : rolled) {
      const Trend& its = wanted.at(trend.begin);
      EXPECT_NEAR(trend.mean, its.mean, 1e-9 * std::max(1.0, std::abs(its.mean)));
      Trend same = trend;
      same.mean = its.mean;
      EXPECT_EQ(same, its) << "round " << round;
    }
  }
}

TEST(Rollup, WiderSpansAreTheirParts) {
  std::mt19937 random(15);
  for (int round = 0; round < 200; ++round) {
    std::vector<Set> sets;
    Millis time = 6000;
    for (int i = 0; i < 60; ++i) {
      sets.push_back({time, std::nullopt, true});
      if (random() % 4 != 0) sets.back().value = static_cast<double>(random() % 1000) / 3.0;
      time += 1 + random() % 300;
    }
    const std::vector<Trend> narrow = Rolled(sets, time, 100, random);
    std::map<Millis, Trend> merged;
    for (const Trend& trend : narrow) {
      const Millis begin = FloorTo(trend.begin, 1500);
      const auto [found, first] = merged.try_emplace(begin, trend);
      if (!first) Merge(found->second, trend);
      found->second.begin = begin;
    }
    const std::vector<Trend> wide = Rolled(sets, time, 1500, random);
    ASSERT_EQ(wide.size(), merged.size());
    for (const Trend& trend : wide) {
      Trend same = merged.at(trend.begin);
      EXPECT_NEAR(same.mean, trend.mean, 1e-9 * std::abs(trend.mean));
      same.mean = trend.mean;
      EXPECT_EQ(same, trend);
    }
  }
}

}  // namespace
}  // namespace baudgate::history
