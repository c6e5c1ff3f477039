// When a subscriber takes its samples: at once when there are few, in lots when there are many.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "gateway/outputs/dds/fast/subscriber.h"

namespace baudgate::dds {
namespace {

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

TEST(TakingThread, WhatComesDuringARoundIsTakenInTheNext) {
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
