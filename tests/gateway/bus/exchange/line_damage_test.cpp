// Damage and noise in place of a reply, or before it.
// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/bus/exchange/line_fixture.h"

namespace baudgate {
namespace {

TEST_F(LineTest, ReceivingGapAfterDamageIsCorrupt) {
  Reach(State::await_first);
  Bytes damaged = reply_;
  damaged[4] ^= 1U;
  line_.Feed(damaged, At(1010ms));
  EXPECT_TRUE(ends_.empty()) << "a good frame may still follow";
  line_.OnTimer(At(1020ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::corrupt);
  EXPECT_EQ(ends_[0].reason, "checksum");
}

TEST_F(LineTest, CorruptWinsOverPartial) {
  Reach(State::await_first);
  line_.Feed(ToBytes("zz!A1"), At(1010ms));
  line_.OnTimer(At(1020ms));
  EXPECT_EQ(ends_.at(0).outcome, Outcome::corrupt);
}

TEST_F(LineTest, GoodFrameBehindDamageIsTaken) {
  Reach(State::await_first);
  line_.Feed(ToBytes("zz"), At(1010ms));
  line_.Feed(reply_, At(1015ms));
  EXPECT_EQ(ends_.at(0).outcome, Outcome::ok);
}

TEST_F(LineTest, HarmlessNoiseLeavesTheReplyItsTime) {
  Reach(State::await_first);
  line_.Feed(Bytes{0, 0}, At(1010ms));
  line_.OnTimer(At(1020ms));
  EXPECT_EQ(line_.state(), State::await_first);
  EXPECT_EQ(DeadlineIn(), 1104ms);
  line_.Feed(reply_, At(1090ms));
  EXPECT_EQ(ends_.at(0).outcome, Outcome::ok);
}

TEST_F(LineTest, HarmlessNoiseAloneIsNoReply) {
  Reach(State::await_first);
  line_.Feed(Bytes{0}, At(1100ms));
  line_.OnTimer(At(1110ms));
  EXPECT_EQ(ends_.at(0).outcome, Outcome::no_reply);
}

TEST_F(LineTest, BabbleEndsAtTheCeilingOfTheExchange) {
  Reach(State::await_first);
  Duration at = 1010ms;
  while (ends_.empty() && at < 3s) {
    if (line_.Deadline() && DeadlineIn() <= at) line_.OnTimer(*line_.Deadline());
    line_.Feed(ToBytes("U"), At(at));
    at += 1ms;
  }
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::corrupt);
  EXPECT_GE(at, 1304ms);
  EXPECT_LE(at, 1306ms) << "one deadline for the exchange, not one per byte";
}

}  // namespace
}  // namespace baudgate
