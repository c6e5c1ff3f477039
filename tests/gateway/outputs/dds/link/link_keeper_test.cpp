// When the process is started, shown as silent, given up and started again, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "gateway/outputs/dds/link/process_link.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

using ::testing::ElementsAre;
using Phase = LinkState::Phase;
using Wish = LinkKeeper::Wish;

/// Waits for the wish to start; returns how long that took.
Duration UntilStart(LinkKeeper& keeper, Instant& now) {
  const Instant from = now;
  while (keeper.Look(now) != Wish::start) now = std::max(now, keeper.NextLook());
  return now - from;
}

/// `passed` datagrams, `fragments` refused, from as many participants as were let in.
LinkCounts Counts(std::uint32_t subscribers, std::uint64_t written, std::uint64_t refused,
                  std::uint32_t passed, std::uint64_t fragments) {
  LinkCounts counts{.subscribers = {.points = subscribers}, .written = written, .refused = refused};
  counts.datagrams.passed = counts.datagrams.participants = passed;
  counts.datagrams.refused[static_cast<std::size_t>(Refusal::fragment)] = fragments;
  return counts;
}

TEST(LinkKeeper, StartsAtOnceAndIsUpWhenOpened) {
  LinkKeeper keeper(true);
  EXPECT_EQ(keeper.Look(kStart), Wish::start);
  keeper.Started(kStart);
  EXPECT_EQ(keeper.state().phase, Phase::starting);
  EXPECT_EQ(keeper.Look(kStart), Wish::nothing);
  keeper.Opened(kStart + 20ms);
  EXPECT_EQ(keeper.state().phase, Phase::up);
}

TEST(LinkKeeper, WaitsLongerAfterEachEndAndBeginsAnewAfterAMinuteOfLife) {
  LinkKeeper keeper(true);
  Instant now = kStart;
  UntilStart(keeper, now);
  std::vector<Duration> waits;
  for (int i = 0; i < 8; ++i) {
    keeper.Started(now);
    keeper.Opened(now);
    keeper.Ended("was ended by signal 6", now);
    waits.push_back(UntilStart(keeper, now));
  }
  EXPECT_THAT(waits, ElementsAre(100ms, 500ms, 1s, 2s, 5s, 10s, 10s, 10s));
  EXPECT_EQ(keeper.state().times_lost, 8U);

  keeper.Started(now);
  keeper.Opened(now);
  now += 1min;
  keeper.Counted({}, now);
  keeper.Ended("was ended by signal 6", now);
  EXPECT_EQ(UntilStart(keeper, now), 100ms);
}

TEST(LinkKeeper, OneThatNeverOpensIsNotLostButWaitedFor) {
  LinkKeeper keeper(true);
  Instant now = kStart;
  for (int i = 0; i < 3; ++i) {
    UntilStart(keeper, now);
    keeper.Ended("cannot be started: there is no such file", now);
  }
  EXPECT_EQ(keeper.state().phase, Phase::waiting);
  EXPECT_EQ(keeper.state().reason, "cannot be started: there is no such file");
  EXPECT_EQ(keeper.state().next_start, now + 1s);
  EXPECT_EQ(keeper.state().times_lost, 0U);
}

TEST(LinkKeeper, SilenceIsShownAfterTwoSecondsAndEndedAfterTen) {
  LinkKeeper keeper(true);
  keeper.Look(kStart);
  keeper.Started(kStart);
  keeper.Opened(kStart);
  keeper.Counted(Counts(3, 10, 0, 0, 0), kStart + 1s);
  EXPECT_EQ(keeper.NextLook(), kStart + 3s);
  EXPECT_EQ(keeper.Look(kStart + 3s - 1ns), Wish::nothing);
  EXPECT_EQ(keeper.state().phase, Phase::up);
  EXPECT_EQ(keeper.Look(kStart + 3s), Wish::nothing);
  EXPECT_EQ(keeper.state().phase, Phase::silent);
  EXPECT_EQ(keeper.state().subscribers.points, 3U);
  EXPECT_EQ(keeper.NextLook(), kStart + 11s);
  EXPECT_EQ(keeper.Look(kStart + 11s - 1ns), Wish::nothing);
  EXPECT_EQ(keeper.Look(kStart + 11s), Wish::give_up);
}

TEST(LinkKeeper, OneThatReadsAgainIsUpAgain) {
  LinkKeeper keeper(true);
  keeper.Look(kStart);
  keeper.Started(kStart);
  keeper.Opened(kStart);
  keeper.Look(kStart + 5s);
  ASSERT_EQ(keeper.state().phase, Phase::silent);
  keeper.Counted({}, kStart + 6s);
  EXPECT_EQ(keeper.state().phase, Phase::up);
  EXPECT_EQ(keeper.Look(kStart + 7s), Wish::nothing);
}

TEST(LinkKeeper, OneThatNeverOpensIsGivenUpAfterAMinute) {
  LinkKeeper keeper(true);
  keeper.Look(kStart);
  keeper.Started(kStart);
  EXPECT_EQ(keeper.Look(kStart + 59s), Wish::nothing);
  EXPECT_EQ(keeper.state().phase, Phase::silent);
  EXPECT_EQ(keeper.NextLook(), kStart + 1min);
  EXPECT_EQ(keeper.Look(kStart + 1min), Wish::give_up);
  EXPECT_EQ(keeper.patience(), 1min);
}

TEST(LinkKeeper, CountsGoOnOverProcesses) {
  LinkKeeper keeper(true);
  keeper.Look(kStart);
  keeper.Started(kStart);
  keeper.Opened(kStart);
  keeper.Counted(Counts(2, 90, 0, 40, 3), kStart);
  keeper.Counted(Counts(2, 100, 1, 50, 4), kStart);
  keeper.Ended("was ended by signal 9", kStart);
  EXPECT_EQ(keeper.state().subscribers.points, 0U);
  EXPECT_EQ(keeper.state().datagrams.passed, 50U);
  EXPECT_EQ(keeper.state().datagrams.participants, 0U);
  keeper.Started(kStart + 1s);
  keeper.Opened(kStart + 1s);
  keeper.Counted(Counts(1, 20, 2, 7, 5), kStart + 1s);
  EXPECT_EQ(keeper.state().subscribers.points, 1U);
  EXPECT_EQ(keeper.state().written, 120U);
  EXPECT_EQ(keeper.state().refused, 3U);
  EXPECT_EQ(keeper.state().datagrams.passed, 57U);
  EXPECT_EQ(keeper.state().datagrams.Refused(Refusal::fragment), 9U);
  EXPECT_EQ(keeper.state().datagrams.participants, 7U);
}

TEST(LinkKeeper, OneThatSomebodyElseStartsIsAwaited) {
  LinkKeeper keeper(false);
  EXPECT_EQ(keeper.Look(kStart), Wish::nothing);
  EXPECT_EQ(keeper.NextLook(), Instant::max());
  keeper.Started(kStart);
  keeper.Opened(kStart);
  keeper.Ended("closed the link", kStart + 1s);
  EXPECT_EQ(keeper.Look(kStart + 1h), Wish::nothing);
  EXPECT_EQ(keeper.state().next_start, std::nullopt);
  EXPECT_EQ(keeper.state().times_lost, 1U);
}

TEST(LinkKeeper, RemembersWhereSubscribersAreUntilTheNextProcessHasMetThem) {
  LinkKeeper keeper(true);
  const config::HostPort first{"10.0.0.1", 7410};
  const config::HostPort second{"10.0.0.2", 7410};
  const config::HostPort third{"10.0.0.3", 7410};
  const auto counted = [&](std::vector<config::HostPort> reached, Instant now) {
    LinkCounts counts;
    counts.neighbours = {.reached = std::move(reached), .remarks = {"10.0.0.9 was heard"}};
    keeper.Counted(counts, now);
  };
  keeper.Started(kStart);
  keeper.Opened(kStart);
  counted({first, second}, kStart + 1s);
  EXPECT_THAT(keeper.state().remarks, ElementsAre("10.0.0.9 was heard"));
  keeper.Ended("was ended by signal 6", kStart + 2s);
  EXPECT_THAT(keeper.reached(), ElementsAre(first, second));
  EXPECT_TRUE(keeper.state().remarks.empty());

  keeper.Started(kStart + 3s);
  keeper.Opened(kStart + 3s);
  counted({third, second}, kStart + 4s);
  EXPECT_THAT(keeper.reached(), ElementsAre(third, second, first));
  counted({third, second}, kStart + 3s + LinkKeeper::kYoung);
  EXPECT_THAT(keeper.reached(), ElementsAre(third, second)) << "the first one is gone";
}

}  // namespace
}  // namespace baudgate::dds
