// Bytes that come before the computed end of transmission: a reply, or not, by what keeps the bit
// rate.
// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/bus/exchange/line_fixture.h"

namespace baudgate {
namespace {

TEST_F(LineTest, AWholeReplyEndsTheSendingWhereNothingKeepsTheBitRate) {
  Reach(State::sending);
  line_.Feed(View(reply_).first(3), At(1001ms));
  EXPECT_TRUE(ends_.empty());
  EXPECT_EQ(line_.state(), State::sending);
  line_.Feed(View(reply_).subspan(3), At(1002ms));
  EXPECT_EQ(frames_.size(), 1U);
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::ok);
  EXPECT_EQ(ends_[0].round_trip, 2ms);
  EXPECT_TRUE(line_.idle());
}

TEST_F(LineTest, AForeignReplyWhileSendingIsDrainedFromTheEndOfTransmission) {
  Reach(State::sending);
  verdict_ = Outcome::unexpected;
  line_.Feed(reply_, At(1001ms));
  EXPECT_EQ(line_.state(), State::drain);
  EXPECT_EQ(DeadlineIn(), 1004ms + kTimes.drain);
}

TEST_F(LineTest, WhatMayBeAnEchoWaitsForTheEndOfTransmission) {
  Opened();
  Exchange exchange;
  exchange.request.bytes = ToBytes("?A1\r");
  exchange.request.expect = ToyProtocol().expect(exchange.request.bytes, {});
  exchange.request.expect.mirrors = true;
  exchange.reply_rule = ToyProtocol().reply_rule;
  exchange.times = kTimes;
  line_.Start(std::move(exchange), At(1s));
  line_.Feed(reply_, At(1001ms));
  EXPECT_TRUE(frames_.empty());
  line_.OnTimer(At(1004ms));
  EXPECT_EQ(frames_.size(), 1U);
}

TEST_F(LineTest, EarlyBytesAreStrayWhereThePortKeepsItsBitRate) {
  line_.OnOpened(At(0ms), true);
  Start(1s);
  line_.Feed(ToyReply("A1=4"), At(1002ms));  // the second copy of an earlier reply
  line_.OnTimer(At(1004ms));
  EXPECT_TRUE(frames_.empty());
  line_.Feed(reply_, At(1020ms));
  ASSERT_EQ(frames_.size(), 1U);
  EXPECT_EQ(frames_[0], AsText(reply_));
  ASSERT_EQ(strays_.size(), 1U);
  EXPECT_EQ(strays_[0].count, ToyReply("A1=4").size());
}

TEST_F(LineTest, APortThatOnlyClaimsToKeepItsBitRateIsFoundOut) {
  line_.OnOpened(At(0ms), true);
  Start(1s);
  line_.Feed(reply_, At(1002ms));
  line_.OnTimer(At(1004ms));
  EXPECT_TRUE(frames_.empty());
  line_.OnTimer(At(1104ms));  // nothing else has come in the reply time
  ASSERT_EQ(frames_.size(), 1U);
  EXPECT_EQ(ends_.back().outcome, Outcome::ok);
  Start(2s);
  line_.Feed(reply_, At(2002ms));
  line_.OnTimer(At(2004ms));
  EXPECT_EQ(frames_.size(), 2U) << "from now on at once";
}

/// The program was stopped meanwhile: nobody knows how old the reply is.
TEST_F(LineTest, AnEarlyReplyThatHasWaitedIsNoReply) {
  line_.OnOpened(At(0ms), true);
  Start(1s);
  line_.Feed(reply_, At(1002ms));
  line_.OnTimer(At(5s));
  line_.OnTimer(At(5s));
  EXPECT_TRUE(frames_.empty());
  EXPECT_EQ(ends_.back().outcome, Outcome::no_reply);
}

TEST_F(LineTest, EarlyNoiseAloneIsNoReply) {
  line_.OnOpened(At(0ms), true);
  Start(1s);
  line_.Feed(ToBytes("UUU"), At(1002ms));
  line_.OnTimer(At(1004ms));
  line_.OnTimer(At(1104ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::no_reply);
}

TEST_F(LineTest, BytesBehindALateTimerAreTheReply) {
  line_.OnOpened(At(0ms), true);
  Start(1s);
  line_.Feed(reply_, At(1015ms));
  ASSERT_EQ(frames_.size(), 1U);
}

}  // namespace
}  // namespace baudgate
