// Readers and writers of others under virtual time: too many of one, of all, too fast.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/outputs/dds/fast/domain_tables.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

Guid Endpoint(std::uint8_t participant, std::uint32_t number) {
  Guid guid{};
  guid[0] = participant;
  for (std::size_t i = 0; i < 4; ++i) guid[12 + i] = static_cast<std::uint8_t>(number >> (8 * i));
  return guid;
}

class EndpointTableTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (std::uint8_t number = 1; number <= 20; ++number) Join(number);
  }
  void Join(std::uint8_t number) {
    ASSERT_EQ(participants_.Announce(PrefixOf(Endpoint(number, 0)), number, 20s, kStart),
              Refusal::none);
  }
  /// How many of them got in.
  std::size_t Announce(std::uint8_t participant, std::uint32_t first, std::uint32_t count,
                       Instant now = kStart) {
    std::size_t in = 0;
    for (std::uint32_t number = first; number < first + count; ++number) {
      if (table_.Announce(Endpoint(participant, number), participants_, now)) ++in;
    }
    return in;
  }

  ParticipantTable participants_{ParticipantLimits{}};
  EndpointTable table_{EndpointLimits{}};
};

TEST_F(EndpointTableTest, OneParticipantHas512) {
  EXPECT_EQ(Announce(1, 1, 600), 512U);
  EXPECT_EQ(Announce(1, 1, 512), 512U) << "they are there already";
  EXPECT_EQ(Announce(2, 1, 10), 10U) << "others are not touched";
  EXPECT_EQ(Announce(1, 1000, 1, kStart + 1h), 0U);
  table_.Left(Endpoint(1, 7));
  EXPECT_EQ(Announce(1, 1000, 1, kStart + 1h), 1U);
}

TEST_F(EndpointTableTest, AllHave8192) {
  std::size_t in = 0;
  for (std::uint8_t number = 1; number <= 20; ++number) in += Announce(number, 1, 512);
  EXPECT_EQ(in, 8192U);
  EXPECT_EQ(table_.size(), 8192U);
  table_.ParticipantLeft(PrefixOf(Endpoint(3, 0)));
  EXPECT_EQ(Announce(20, 1, 512), 512U);
}

TEST_F(EndpointTableTest, WhoComesAndGoesWithoutEndIsSlowedDown) {
  std::size_t in = 0;
  for (std::uint32_t number = 1; number <= 10'000; ++number) {
    in += Announce(1, number, 1);
    table_.Left(Endpoint(1, number));
  }
  EXPECT_EQ(in, 512U);
  EXPECT_EQ(Announce(1, 20'000, 1000, kStart + 1s), 100U);
}

TEST_F(EndpointTableTest, WhoeverIsNoParticipantIsNotCounted) {
  EXPECT_EQ(Announce(99, 1, 10'000), 10'000U);
  EXPECT_EQ(table_.size(), 0U);
}

TEST_F(EndpointTableTest, WhatParticipantsLeaveBehindIsForgotten) {
  Announce(1, 1, 512);
  participants_.Left(PrefixOf(Endpoint(1, 0)));
  EXPECT_EQ(Announce(2, 1, 1), 1U);
  EXPECT_EQ(table_.size(), 1U);
}

}  // namespace
}  // namespace baudgate::dds
