// Tests of the means of minutes and hours, of charts, and of the encoding of entries.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>

#include "gateway/records/history/batch.h"
#include "gateway/records/history/chunk.h"
#include "gateway/records/history/history_view.h"
#include "tests/gateway/outputs/web/fakes.h"

namespace baudgate::history {
namespace {

struct Set {
  Millis time = 0;
  std::optional<double> value;
  bool reading = true;
};

/// Computes the expected trends millisecond by millisecond, with long double.
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
    if (random() % 3 == 0) rollup.Advance(set.time, out);
  }
  rollup.Forget(end, out);
  return out;
}

TEST(Rollup, MatchesTheExample) {
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

TEST(Rollup, WiderSpansEqualTheirMergedParts) {
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

using web::FakeHistory;
using web::kDayBegin;

constexpr const char* kPoint = "bay-1.feeder-1.current";

TEST(Chart, ShortTimesUseEveryValue) {
  const FakeHistory source;
  const auto chart = ReadChart(source, {kPoint, kDayBegin, kDayBegin + 10 * kMinute, 60});
  ASSERT_TRUE(chart);
  EXPECT_TRUE(chart->known);
  EXPECT_EQ(chart->step, 10 * kSecond);
  ASSERT_EQ(chart->rows.size(), 30U) << "what is bad is a hole";
  const Trend& second = chart->rows[1];
  EXPECT_EQ(second.begin, kDayBegin + 10 * kSecond);
  EXPECT_EQ(second.min, 20);
  EXPECT_EQ(second.max, 29);
  EXPECT_DOUBLE_EQ(second.mean, 24.5);
  EXPECT_EQ(second.good, 10 * kSecond);
  EXPECT_EQ(chart->rows[3].begin, kDayBegin + 60 * kSecond);
}

TEST(Chart, ASectionBeginsWithThePreviousValue) {
  const FakeHistory source;
  const auto chart = ReadChart(source, {kPoint, kDayBegin + 5500, kDayBegin + 6500, 1200});
  ASSERT_TRUE(chart);
  EXPECT_EQ(chart->step, kSecond);
  ASSERT_EQ(chart->rows.size(), 2U);
  EXPECT_EQ(chart->rows[0].begin, kDayBegin + 5000);
  EXPECT_EQ(chart->rows[0].mean, 15);
  EXPECT_EQ(chart->rows[1].good, 500);
}

TEST(Chart, LongTimesUseMinutesAndHours) {
  const FakeHistory source;
  const auto year = ReadChart(source, {kPoint, kDayBegin, kDayBegin + 365 * kDay, 1200});
  ASSERT_TRUE(year);
  EXPECT_EQ(year->step, 438 * kMinute);
  EXPECT_EQ(source.every, year->step);
  EXPECT_EQ(year->rows.size(), 1U);
  const auto day = ReadChart(source, {kPoint, kDayBegin, kDayBegin + kDay, 1200});
  EXPECT_EQ(day->step, 2 * kMinute);
}

TEST(Chart, AlwaysHasAStep) {
  const FakeHistory source;
  for (const Millis span : {Millis{1}, kSecond, kMinute, kHour, 20 * 366 * kDay}) {
    for (const std::int64_t pixels : {1, 7, 4096}) {
      const auto chart = ReadChart(source, {"a.b.c", kDayBegin, kDayBegin + span, pixels});
      ASSERT_TRUE(chart);
      EXPECT_GE(chart->step * pixels, span);
      EXPECT_FALSE(chart->known);
      EXPECT_TRUE(chart->step < kMinute || chart->step % kMinute == 0);
    }
  }
}

constexpr Millis kFirst = 1'790'000'000'000;

std::vector<Entry> Series(std::size_t count, const std::function<Value(std::size_t)>& value,
                          Millis step = 1000, unsigned jitter = 5) {
  std::mt19937 random(1);
  std::vector<Entry> entries;
  for (std::size_t i = 0; i < count; ++i) {
    const Millis at = static_cast<Millis>(i) * step + static_cast<Millis>(random() % jitter);
    entries.push_back({kFirst + at, value(i), Quality::good});
  }
  return entries;
}

double BytesEach(const std::vector<Entry>& entries) {
  const Bytes bytes = EncodeChunk(entries);
  const auto back = DecodeChunk(bytes);
  EXPECT_TRUE(back && *back == entries);
  return static_cast<double>(bytes.size()) / static_cast<double>(entries.size());
}

TEST(Chunk, EncodesAndDecodesEveryKindOfValue) {
  std::mt19937_64 random(2);
  const std::vector<std::function<Value(std::size_t)>> kinds = {
      [](std::size_t) { return Value(); },
      [&](std::size_t) { return Value(random() % 2 == 0); },
      [&](std::size_t) { return Value(static_cast<std::int64_t>(random())); },
      [&](std::size_t) { return Value(static_cast<std::uint64_t>(random())); },
      [](std::size_t i) { return Value(static_cast<std::uint64_t>(i) << 60U); },
      [](std::size_t i) { return Value(0.1 * static_cast<double>(i)); },
      [](std::size_t i) { return Value(static_cast<double>(i) / 100); },
      [](std::size_t i) { return Value(-static_cast<double>(i % 7) * 0.001); },
      [](std::size_t i) { return Value(static_cast<double>(std::sin(static_cast<float>(i)))); },
      [](std::size_t i) { return Value(std::sin(static_cast<double>(i))); },
      [](std::size_t i) { return Value(i % 2 == 0 ? -0.0 : 1e300 * static_cast<double>(i)); },
      [](std::size_t i) { return Value(i == 3 ? std::numeric_limits<double>::infinity() : 0.5); },
      [](std::size_t i) { return Value(std::string(i % 5, static_cast<char>(i))); },
      [](std::size_t i) {
        if (i % 3 == 0) return Value(std::string("fault"));
        return i % 3 == 1 ? Value(static_cast<double>(i)) : Value(true);
      },
  };
  for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
    for (const std::size_t count : {1U, 2U, 3U, 500U}) {
      auto entries = Series(count, kinds[kind]);
      for (std::size_t i = 0; i < count; i += 7) {
        entries[i].quality = Quality::OfWord(static_cast<std::uint16_t>(0x0310 + i));
        if (i % 2 == 0) entries[i].value = {};
      }
      const auto back = DecodeChunk(EncodeChunk(entries));
      ASSERT_TRUE(back) << kind;
      EXPECT_EQ(*back, entries) << kind;
      if (kind == 10 && count > 2) {
        EXPECT_TRUE(std::signbit(std::get<double>((*back)[2].value)));
      }
    }
  }
}

TEST(Chunk, IsSmall) {
  std::mt19937 random(3);
  double level = 0;
  const auto walk = [&](double by) {
    return level += by * (static_cast<double>(random() % 5) - 2);
  };
  EXPECT_LT(BytesEach(Series(3600, [](std::size_t i) { return Value(i / 900 % 2 == 0); })), 1.0)
      << "a state";
  EXPECT_LT(BytesEach(Series(3600, [&](std::size_t) { return Value(std::round(walk(1)) * 0.1); })),
            2.2)
      << "a scaled whole number";
  EXPECT_LT(BytesEach(Series(100, [&](std::size_t) { return Value(std::round(walk(1)) * 0.1); })),
            3.0)
      << "and few of them";
  EXPECT_LT(BytesEach(Series(3600,
                             [](std::size_t i) {
                               return Value(std::int64_t{230} + static_cast<std::int64_t>(i / 60));
                             })),
            1.0)
      << "a counter";
}

TEST(Chunk, RandomBytesAreHarmless) {
  std::mt19937 random(4);
  auto entries = Series(200, [](std::size_t i) { return Value(0.1 * static_cast<double>(i)); });
  const Bytes good = EncodeChunk(entries);
  for (int round = 0; round < 20'000; ++round) {
    Bytes bytes = good;
    for (std::size_t i = 1 + random() % 3; i > 0; --i) {
      bytes[random() % (round % 2 == 0 ? 12 : bytes.size())] = static_cast<std::uint8_t>(random());
    }
    if (round % 3 == 0) bytes.resize(random() % bytes.size());
    const auto back = DecodeChunk(bytes);
    if (!back) continue;
    EXPECT_LE(back->size(), kMostInChunk);
    for (std::size_t i = 1; i < back->size(); ++i) {
      ASSERT_GT((*back)[i].time, (*back)[i - 1].time);
    }
  }
  EXPECT_FALSE(DecodeChunk({}));
}

}  // namespace
}  // namespace baudgate::history
