// Requests that are repeated, or replaced, after a failure, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <utility>

#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

TEST(PollerRetries, AreBoundedAndCounted) {
  config::Line config = ToyLine({ToyDevice("a", "A", {"1"})});
  config.retries = 2;
  VirtualLine line(config, {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  const std::size_t before = line.CountSent("?A1");
  line.twin(0).manner.dead = true;
  line.RunFor(1400ms);
  EXPECT_EQ(line.CountSent("?A1") - before, 3U) << "one and two retries";
  EXPECT_EQ(line.StatusOf(0).retries, 2U);
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::no_reply), 3U);
}

TEST(PollerRetries, OneLostReplyIsMadeUpForAtOnce) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  int lost = 1;
  line.twin(0).manner.distort = [&](Bytes reply) { return lost-- > 0 ? Bytes() : reply; };
  const std::uint32_t ok = line.StatusOf(0).Count(Outcome::ok);
  line.RunFor(1s);
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::ok), ok + 1);
  EXPECT_EQ(line.StatusOf(0).retries, 1U);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
}

TEST(PollerRetries, DestructiveReadIsNotRepeated) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"D1"})}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1500ms);
  const std::size_t before = line.CountSent("LA1");
  line.twin(0).manner.dead = true;
  line.RunFor(900ms);
  EXPECT_EQ(line.CountSent("LA1") - before, 1U);
  EXPECT_EQ(line.CountSent("BA"), 0U);
}

TEST(PollerRetries, TheConversationPutsAnotherRequestInItsPlace) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"L1"})}), {&ToyProtocol()});
  line.twin(0).values.Set(0, 5.0);
  line.Open();
  line.RunFor(1500ms);
  const std::size_t before = line.CountSent("LA1");
  bool damaged = false;
  line.twin(0).manner.distort = [&](Bytes reply) {
    if (!std::exchange(damaged, true)) reply[1] ^= 0x40U;
    return reply;
  };
  line.twin(0).values.Set(0, 6.0);
  line.RunFor(1s);
  EXPECT_EQ(line.CountSent("LA1") - before, 1U);
  EXPECT_EQ(line.CountSent("BA1"), 2U) << "the first answer may be the late one to L";
  EXPECT_EQ(line.ValueOf(0, 0), Value(6.0)) << "what L destroyed, B repeats";
  EXPECT_EQ(line.StatusOf(0).Count(Outcome::corrupt), 1U);
}

}  // namespace
}  // namespace baudgate
