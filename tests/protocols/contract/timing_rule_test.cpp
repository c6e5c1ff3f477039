// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "protocols/protocol.h"

namespace baudgate {
namespace {

/// 8 bits, no parity, 1 stop bit: ten bits a character, 1 ms at 10,000 bit/s.
config::SerialSettings At(int baud) { return {.baud = baud}; }

TEST(TimingRule, ASpanIsTheLongerOfTimeAndCharacters) {
  const TimingRule::Span span = {.least = 5ms, .characters = 3.5, .plus = 1ms};
  EXPECT_EQ(span.At(1ms), 5ms);
  EXPECT_EQ(span.At(2ms), 8ms);
  EXPECT_EQ(TimingRule::Span{}.At(2ms), Duration::zero());
}

TEST(TimingRule, TheCeilingHoldsTheLongestReplyAndItsGaps) {
  const TimingRule rule = {.quiet = {.least = 2ms},
                           .reply = {.least = 100ms},
                           .gap = {.characters = 20},
                           .drain = {.least = 50ms},
                           .longest = 200,
                           .gaps = 2};
  const config::Timing timing = rule(At(10'000));
  EXPECT_EQ(timing.quiet, 2ms);
  EXPECT_EQ(timing.reply, 100ms);
  EXPECT_EQ(timing.gap, 20ms);
  EXPECT_EQ(timing.drain, 50ms);
  EXPECT_EQ(timing.ceiling, 100ms + 200ms + 2 * 20ms);
}

TEST(TimingRule, TheTimeOfTheLongestReplyMayBeBounded) {
  const TimingRule rule = {
      .longest = 4000, .gaps = 0, .longest_time = {.least = 1s, .characters = 500}};
  EXPECT_EQ(rule(At(100'000)).ceiling, 400ms) << "short enough";
  EXPECT_EQ(rule(At(10'000)).ceiling, 1s) << "1 s in place of 4 s";
  EXPECT_EQ(rule(At(1'000)).ceiling, 5s) << "500 characters take longer than 1 s";
}

}  // namespace
}  // namespace baudgate
