// How far writers may jump, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/outputs/dds/fast/domain_tables.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

Guid WriterGuid(std::uint32_t number, std::uint8_t kind) {
  Guid guid{};
  for (std::size_t i = 0; i < 4; ++i) guid[i] = static_cast<std::uint8_t>(number >> (8 * i));
  guid[15] = kind;
  return guid;
}

constexpr std::uint8_t kDiscovery = 0xC2;
constexpr std::uint8_t kOfSamples = 0x02;
constexpr WindowLimits kSmall{.burst = 1000, .each_second = 100, .first_of_samples = 5000};

TEST(SequenceWindow, AllShareWhatMayBeSkipped) {
  SequenceWindow window(kSmall);
  EXPECT_TRUE(window.Advance(WriterGuid(1, kDiscovery), 600, 0, kStart));
  EXPECT_TRUE(window.Advance(WriterGuid(1, kDiscovery), 600, 0, kStart)) << "again: nothing new";
  EXPECT_TRUE(window.Advance(WriterGuid(1, kDiscovery), 10, 0, kStart)) << "nor is what is old";
  EXPECT_FALSE(window.Advance(WriterGuid(2, kDiscovery), 401, 0, kStart));
  EXPECT_TRUE(window.Advance(WriterGuid(2, kDiscovery), 400, 0, kStart));
  EXPECT_FALSE(window.Advance(WriterGuid(1, kDiscovery), 601, 0, kStart));
  EXPECT_TRUE(window.Advance(WriterGuid(1, kDiscovery), 700, 0, kStart + 1s)) << "100 a second";
  EXPECT_FALSE(window.Advance(WriterGuid(1, kDiscovery), 1701, 0, kStart + 1h))
      << "never above 1000";
  EXPECT_TRUE(window.Advance(WriterGuid(1, kDiscovery), 1700, 0, kStart + 1h));
}

TEST(SequenceWindow, AGapCostsItsLengthEachTime) {
  SequenceWindow window(kSmall);
  EXPECT_TRUE(window.Advance(WriterGuid(1, kDiscovery), 600, 600, kStart));
  EXPECT_FALSE(window.Advance(WriterGuid(1, kDiscovery), 600, 600, kStart));
}

TEST(SequenceWindow, AWriterOfSamplesBeginsWhereItIs) {
  SequenceWindow window(kSmall);
  EXPECT_FALSE(window.Advance(WriterGuid(1, kOfSamples), 5001, 0, kStart));
  EXPECT_TRUE(window.Advance(WriterGuid(1, kOfSamples), 5000, 0, kStart));
  EXPECT_TRUE(window.Advance(WriterGuid(1, kOfSamples), 6000, 0, kStart));
  EXPECT_FALSE(window.Advance(WriterGuid(1, kOfSamples), 6001, 0, kStart));
}

TEST(SequenceWindow, ManyInventedWritersDoNotMakeItForgetSoonHeardOnes) {
  SequenceWindow window(kSmall);
  const Guid known = WriterGuid(1, kOfSamples);
  EXPECT_TRUE(window.Advance(known, 5000, 0, kStart));
  for (std::uint32_t number = 2; number < 100'000; ++number) {
    window.Advance(WriterGuid(number, kOfSamples), 1, 0, kStart);
    EXPECT_TRUE(window.Advance(known, 5000, 0, kStart + 1ms));
  }
  EXPECT_FALSE(window.Advance(known, 6001, 0, kStart + 1ms)) << "it is still known to be at 5000";
}

}  // namespace
}  // namespace baudgate::dds
