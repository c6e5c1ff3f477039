// Tests of `ParticipantTable`, `EndpointTable`, `SequenceWindow` and `TakingThread`.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "gateway/outputs/dds/fast/domain_tables.h"
#include "gateway/outputs/dds/fast/participant.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

GuidPrefix GuidPrefixOf(std::uint32_t number) {
  GuidPrefix prefix{};
  for (std::size_t i = 0; i < 4; ++i) prefix[i] = static_cast<std::uint8_t>(number >> (8 * i));
  return prefix;
}

std::size_t AnnounceMany(ParticipantTable& table, std::uint32_t first, std::uint32_t count,
                         Instant now, std::optional<std::uint32_t> address = {}) {
  std::size_t in = 0;
  for (std::uint32_t number = first; number < first + count; ++number) {
    const std::uint32_t from = address.value_or(number);
    if (table.Announce(GuidPrefixOf(number), from, 20s, now) == Refusal::none) ++in;
  }
  return in;
}

TEST(ParticipantTable, HoldsAtMost256Participants) {
  ParticipantTable table{ParticipantLimits{}};
  EXPECT_EQ(AnnounceMany(table, 1, 300, kStart), 256U);
  EXPECT_EQ(table.Announce(GuidPrefixOf(1000), 1, 20s, kStart), Refusal::participants);
  EXPECT_EQ(table.size(), 256U);
  EXPECT_EQ(table.Announce(GuidPrefixOf(7), 7, 20s, kStart), Refusal::none)
      << "it is there already";
}

TEST(ParticipantTable, HoldsAtMost128ParticipantsOfAnAddress) {
  ParticipantTable table{ParticipantLimits{}};
  EXPECT_EQ(AnnounceMany(table, 1, 300, kStart, 5), 128U);
  EXPECT_EQ(table.Announce(GuidPrefixOf(1000), 5, 20s, kStart), Refusal::address);
  EXPECT_EQ(table.Announce(GuidPrefixOf(1000), 6, 20s, kStart), Refusal::none);
}

TEST(ParticipantTable, AParticipantSilentBeyondItsLeaseIsReplaced) {
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

TEST(ParticipantTable, AParticipantWithAnExpiredLeaseMustAnnounceItselfAgain) {
  ParticipantTable table{ParticipantLimits{.participants = 1}};
  EXPECT_EQ(table.Announce(GuidPrefixOf(1), 1, 3s, kStart), Refusal::none);
  table.Heard(GuidPrefixOf(1), kStart + 4s);
  EXPECT_EQ(table.Announce(GuidPrefixOf(2), 2, 3s, kStart + 4s), Refusal::none);
}

TEST(ParticipantTable, TheRateOfNewParticipantsIsLimited) {
  ParticipantTable table{ParticipantLimits{}};
  std::size_t in = 0;
  for (std::uint32_t number = 1; number <= 1000; ++number) {
    if (table.Announce(GuidPrefixOf(number), 5, 20s, kStart) == Refusal::none) ++in;
    table.Left(GuidPrefixOf(number));
  }
  EXPECT_EQ(in, 128U);
  EXPECT_EQ(table.size(), 0U);
  EXPECT_EQ(AnnounceMany(table, 2000, 100, kStart + 1s, 5), 8U) << "eight a second of one address";
  EXPECT_EQ(AnnounceMany(table, 3000, 1000, kStart + 1s), 256U - 136U + 50U);
}

TEST(ParticipantTable, ALeavingParticipantFreesItsPlace) {
  ParticipantTable table{ParticipantLimits{.participants = 2}};
  EXPECT_EQ(AnnounceMany(table, 1, 3, kStart), 2U);
  table.Left(GuidPrefixOf(3));
  EXPECT_EQ(table.size(), 2U);
  table.Left(GuidPrefixOf(1));
  EXPECT_EQ(AnnounceMany(table, 3, 2, kStart + 20ms), 1U);
}

TEST(ParticipantTable, DistinguishesReachedAndUnansweredParticipants) {
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

TEST_F(EndpointTableTest, AParticipantHasAtMost512Endpoints) {
  EXPECT_EQ(Announce(1, 1, 600), 512U);
  EXPECT_EQ(Announce(1, 1, 512), 512U) << "they are there already";
  EXPECT_EQ(Announce(2, 1, 10), 10U) << "others are not touched";
  EXPECT_EQ(Announce(1, 1000, 1, kStart + 1h), 0U);
  table_.Left(Endpoint(1, 7));
  EXPECT_EQ(Announce(1, 1000, 1, kStart + 1h), 1U);
}

TEST_F(EndpointTableTest, AllParticipantsTogetherHaveAtMost8192Endpoints) {
  std::size_t in = 0;
  for (std::uint8_t number = 1; number <= 20; ++number) in += Announce(number, 1, 512);
  EXPECT_EQ(in, 8192U);
  EXPECT_EQ(table_.size(), 8192U);
  table_.ParticipantLeft(PrefixOf(Endpoint(3, 0)));
  EXPECT_EQ(Announce(20, 1, 512), 512U);
}

TEST_F(EndpointTableTest, TheRateOfNewEndpointsIsLimited) {
  std::size_t in = 0;
  for (std::uint32_t number = 1; number <= 10'000; ++number) {
    in += Announce(1, number, 1);
    table_.Left(Endpoint(1, number));
  }
  EXPECT_EQ(in, 512U);
  EXPECT_EQ(Announce(1, 20'000, 1000, kStart + 1s), 100U);
}

TEST_F(EndpointTableTest, EndpointsOfUnknownParticipantsAreNotCounted) {
  EXPECT_EQ(Announce(99, 1, 10'000), 10'000U);
  EXPECT_EQ(table_.size(), 0U);
}

TEST_F(EndpointTableTest, EndpointsOfALeftParticipantAreForgotten) {
  Announce(1, 1, 512);
  participants_.Left(PrefixOf(Endpoint(1, 0)));
  EXPECT_EQ(Announce(2, 1, 1), 1U);
  EXPECT_EQ(table_.size(), 1U);
}

TEST(Unanswered, TheAdviceDependsOnTheConfiguredInterfaces) {
  const std::string both_sides =
      "the participant is on this machine and must use an address of dds.interfaces beside "
      "127.0.0.1";
  const struct {
    std::string host;
    bool own;
    std::vector<std::string> interfaces;
    std::string cure;
  } rows[] = {
      {"10.0.0.9",
       false,
       {"127.0.0.1"},
       "add the address of this machine in the network of that host to dds.interfaces"},
      {"10.0.0.5",
       true,
       {"10.0.0.5"},
       "the participant is on this machine, so add 127.0.0.1 to dds.interfaces"},
      {"10.0.0.5",
       true,
       {"127.0.0.1"},
       "the participant is on this machine, so add 10.0.0.5 to dds.interfaces"},
      {"10.0.0.5",
       true,
       {"10.1.0.5"},
       "the participant is on this machine, so add 127.0.0.1 and 10.0.0.5 to dds.interfaces"},
      {"127.0.0.1",
       true,
       {"10.0.0.5"},
       "the participant is on this machine, so add 127.0.0.1 to dds.interfaces"},
      {"127.0.0.1", true, {"127.0.0.1", "10.0.0.5"}, both_sides},
      {"10.0.0.5", true, {"127.0.0.1", "10.0.0.5"}, both_sides},
      {"127.0.0.1", true, {}, both_sides},
      {"127.0.0.1", true, {"0.0.0.0"}, both_sides},
  };
  for (const auto& row : rows) {
    EXPECT_EQ(UnansweredRemark(row.host, row.own, row.interfaces),
              row.host + " was discovered but cannot be answered: " + row.cure);
  }
}

Guid WriterGuid(std::uint32_t number, std::uint8_t kind) {
  Guid guid{};
  for (std::size_t i = 0; i < 4; ++i) guid[i] = static_cast<std::uint8_t>(number >> (8 * i));
  guid[15] = kind;
  return guid;
}

constexpr std::uint8_t kDiscovery = 0xC2;
constexpr std::uint8_t kOfSamples = 0x02;
constexpr WindowLimits kSmall{.burst = 1000, .each_second = 100, .first_of_samples = 5000};

TEST(SequenceWindow, AllWritersShareTheBudgetForSkippedNumbers) {
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

TEST(SequenceWindow, EachGapConsumesItsLengthOfTheBudget) {
  SequenceWindow window(kSmall);
  EXPECT_TRUE(window.Advance(WriterGuid(1, kDiscovery), 600, 600, kStart));
  EXPECT_FALSE(window.Advance(WriterGuid(1, kDiscovery), 600, 600, kStart));
}

TEST(SequenceWindow, AWriterOfSamplesMayStartAtAHighNumber) {
  SequenceWindow window(kSmall);
  EXPECT_FALSE(window.Advance(WriterGuid(1, kOfSamples), 5001, 0, kStart));
  EXPECT_TRUE(window.Advance(WriterGuid(1, kOfSamples), 5000, 0, kStart));
  EXPECT_TRUE(window.Advance(WriterGuid(1, kOfSamples), 6000, 0, kStart));
  EXPECT_FALSE(window.Advance(WriterGuid(1, kOfSamples), 6001, 0, kStart));
}

TEST(SequenceWindow, ManyInventedWritersDoNotEvictAKnownWriter) {
  SequenceWindow window(kSmall);
  const Guid known = WriterGuid(1, kOfSamples);
  EXPECT_TRUE(window.Advance(known, 5000, 0, kStart));
  for (std::uint32_t number = 2; number < 100'000; ++number) {
    window.Advance(WriterGuid(number, kOfSamples), 1, 0, kStart);
    EXPECT_TRUE(window.Advance(known, 5000, 0, kStart + 1ms));
  }
  EXPECT_FALSE(window.Advance(known, 6001, 0, kStart + 1ms)) << "it is still known to be at 5000";
}

TEST(TakingThread, RestsLongerAfterLongerRounds) {
  struct Row {
    Duration round;
    Duration rest;
  };
  for (const Row& row : {Row{0us, 0us}, Row{5us, 45us}, Row{1ms, 9ms}, Row{5ms, 45ms},
                         Row{6ms, 50ms}, Row{10s, 50ms}}) {
    EXPECT_EQ(RestAfter(row.round), row.rest) << FormatDuration(row.round);
  }
}

TEST(TakingThread, AWakeUpDuringARoundStartsOneMoreRound) {
  std::promise<void> in_first;
  std::promise<void> go_on;
  std::promise<void> second;
  int rounds = 0;
  TakingThread thread([&]() -> Duration {
    ++rounds;
    if (rounds == 1) in_first.set_value(), go_on.get_future().wait();
    if (rounds == 2) second.set_value();
    return {};
  });
  thread.Wake();
  in_first.get_future().wait();
  for (int i = 0; i < 100; ++i) thread.Wake();
  go_on.set_value();
  second.get_future().wait();
  thread.Stop();
  EXPECT_EQ(rounds, 2);
}

TEST(TakingThread, NothingRunsAfterStop) {
  std::atomic<int> rounds = 0;
  TakingThread thread([&]() -> Duration { return ++rounds, 0ns; });
  thread.Stop();
  thread.Wake();
  EXPECT_EQ(rounds, 0);
}

}  // namespace
}  // namespace baudgate::dds
