// Entries as bytes and back, and what bytes of others make of it.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/chunk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

namespace baudgate::history {
namespace {

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

TEST(Chunk, BringsBackEveryKindOfValue) {
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

TEST(Chunk, AnyBytesAreSurvived) {
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
