// Places for participants under virtual time: full, silent, too many of one address, too fast.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/outputs/dds/fast/domain_tables.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

GuidPrefix GuidPrefixOf(std::uint32_t number) {
  GuidPrefix prefix{};
  for (std::size_t i = 0; i < 4; ++i) prefix[i] = static_cast<std::uint8_t>(number >> (8 * i));
  return prefix;
}

/// Announces participants `first` … `first + count - 1`, one address each; how many got in.
std::size_t AnnounceMany(ParticipantTable& table, std::uint32_t first, std::uint32_t count,
                         Instant now, std::optional<std::uint32_t> address = {}) {
  std::size_t in = 0;
  for (std::uint32_t number = first; number < first + count; ++number) {
    const std::uint32_t from = address.value_or(number);
    if (table.Announce(GuidPrefixOf(number), from, 20s, now) == Refusal::none) ++in;
  }
  return in;
}

TEST(ParticipantTable, IsFullAt256) {
  ParticipantTable table{ParticipantLimits{}};
  EXPECT_EQ(AnnounceMany(table, 1, 300, kStart), 256U);
  EXPECT_EQ(table.Announce(GuidPrefixOf(1000), 1, 20s, kStart), Refusal::participants);
  EXPECT_EQ(table.size(), 256U);
  EXPECT_EQ(table.Announce(GuidPrefixOf(7), 7, 20s, kStart), Refusal::none)
      << "it is there already";
}

TEST(ParticipantTable, OneAddressHas128) {
  ParticipantTable table{ParticipantLimits{}};
  EXPECT_EQ(AnnounceMany(table, 1, 300, kStart, 5), 128U);
  EXPECT_EQ(table.Announce(GuidPrefixOf(1000), 5, 20s, kStart), Refusal::address);
  EXPECT_EQ(table.Announce(GuidPrefixOf(1000), 6, 20s, kStart), Refusal::none);
}

TEST(ParticipantTable, WhoIsSilentBeyondItsLeaseMakesRoom) {
  ParticipantTable table{ParticipantLimits{.participants = 2}};
  EXPECT_EQ(table.Announce(GuidPrefixOf(1), 1, 3s, kStart), Refusal::none);
  EXPECT_EQ(table.Announce(GuidPrefixOf(2), 2, 3s, kStart), Refusal::none);
  table.Heard(GuidPrefixOf(1), kStart + 3s);
  EXPECT_EQ(table.Announce(GuidPrefixOf(3), 3, 3s, kStart + 3s), Refusal::participants);
  EXPECT_EQ(table.Announce(GuidPrefixOf(3), 3, 3s, kStart + 3001ms), Refusal::none)
      << "2 is silent";
  EXPECT_EQ(table.Announce(GuidPrefixOf(2), 2, 3s, kStart + 3001ms), Refusal::participants);
}

TEST(ParticipantTable, AnEndlessLeaseEndsAfterAMinute) {
  ParticipantTable table{ParticipantLimits{.participants = 1}};
  EXPECT_EQ(table.Announce(GuidPrefixOf(1), 1, Duration::max(), kStart), Refusal::none);
  EXPECT_EQ(table.Announce(GuidPrefixOf(2), 2, 3s, kStart + 60s), Refusal::participants);
  EXPECT_EQ(table.Announce(GuidPrefixOf(2), 2, 3s, kStart + 60s + 1ms), Refusal::none);
}

TEST(ParticipantTable, WhoWasSilentTooLongMustAnnounceItself) {
  ParticipantTable table{ParticipantLimits{.participants = 1}};
  EXPECT_EQ(table.Announce(GuidPrefixOf(1), 1, 3s, kStart), Refusal::none);
  table.Heard(GuidPrefixOf(1), kStart + 4s);
  EXPECT_EQ(table.Announce(GuidPrefixOf(2), 2, 3s, kStart + 4s), Refusal::none);
}

TEST(ParticipantTable, ComingAndGoingIsSlowedDown) {
  ParticipantTable table{ParticipantLimits{}};
  std::size_t in = 0;
  for (std::uint32_t number = 1; number <= 1000; ++number) {
    if (table.Announce(GuidPrefixOf(number), 5, 20s, kStart) == Refusal::none) ++in;
    table.Left(GuidPrefixOf(number));
  }
  EXPECT_EQ(in, 128U);
  EXPECT_EQ(table.size(), 0U);
  EXPECT_EQ(AnnounceMany(table, 2000, 100, kStart + 1s, 5), 8U) << "eight a second of one address";
  // Others, each with an address of its own: 256 in all, 136 of them taken, 50 more each second.
  EXPECT_EQ(AnnounceMany(table, 3000, 1000, kStart + 1s), 256U - 136U + 50U);
}

TEST(ParticipantTable, LeavingMakesRoom) {
  ParticipantTable table{ParticipantLimits{.participants = 2}};
  EXPECT_EQ(AnnounceMany(table, 1, 3, kStart), 2U);
  table.Left(GuidPrefixOf(3));
  EXPECT_EQ(table.size(), 2U);
  table.Left(GuidPrefixOf(1));
  EXPECT_EQ(AnnounceMany(table, 3, 2, kStart + 20ms), 1U);
}

TEST(ParticipantTable, TellsWhoConfirmsAndWhoCanNotBeAnswered) {
  ParticipantTable table{ParticipantLimits{}};
  const auto at = [](std::uint32_t number) { return UdpAddress{number, 7410}; };
  AnnounceMany(table, 1, 4, kStart);
  for (std::uint32_t number = 1; number <= 4; ++number) {
    table.Describe(GuidPrefixOf(number), at(number), number != 3, number != 4);
  }
  table.Confirmed(GuidPrefixOf(1));
  table.Confirmed(GuidPrefixOf(3));
  EXPECT_EQ(table.Reached(kStart), std::vector{at(1)})
      << "2 has confirmed nothing, 3 names the address of somebody else, 4 publishes";
  EXPECT_TRUE(table.Unanswered(kStart + 4999ms).empty()) << "it may take its time";
  EXPECT_EQ(table.Unanswered(kStart + 5s), std::vector{at(2)});
  EXPECT_TRUE(table.Unanswered(kStart + 21s).empty()) << "it is not heard any more";
  EXPECT_TRUE(table.Reached(kStart + 21s).empty());
}

TEST(ParticipantTable, RemembersTheAddressThatAParticipantSpeaksFrom) {
  ParticipantTable table{ParticipantLimits{}};
  AnnounceMany(table, 1, 1, kStart);
  table.Describe(GuidPrefixOf(1), {7, 7410}, true, true);
  table.Describe(GuidPrefixOf(1), {8, 7410}, false, true);
  table.Confirmed(GuidPrefixOf(1));
  EXPECT_EQ(table.Reached(kStart), (std::vector{UdpAddress{7, 7410}}));
}

}  // namespace
}  // namespace baudgate::dds
