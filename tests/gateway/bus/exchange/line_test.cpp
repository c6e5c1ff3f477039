// Tests of `Line`, one for each row of the state table in gateway/bus/exchange/line.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/exchange/line.h"

#include "tests/gateway/bus/exchange/line_fixture.h"

namespace baudgate::bus {
namespace {

TEST_F(LineTest, ClosedOpenedIsIdle) {
  EXPECT_EQ(line_.state(), State::closed);
  Opened();
  EXPECT_TRUE(line_.idle());
  EXPECT_FALSE(line_.Deadline());
}

TEST_F(LineTest, IdleStartSendsAtOnceWhenQuietLongEnough) {
  Reach(State::idle);
  Start(1s);
  EXPECT_EQ(line_.state(), State::sending);
  EXPECT_EQ(sent_, std::vector<std::string>{"?A1\r"});
  EXPECT_EQ(DeadlineIn(), 1004ms) << "the computed end of transmission";
}

TEST_F(LineTest, IdleStartWaitsForSilence) {
  Reach(State::idle);
  line_.Feed(ToBytes("x"), At(998ms));
  Start(1s);
  EXPECT_EQ(line_.state(), State::quiet);
  EXPECT_TRUE(sent_.empty());
  EXPECT_EQ(DeadlineIn(), 1003ms);
}

TEST_F(LineTest, IdleBytesAreStray) {
  Reach(State::idle);
  line_.Feed(ToBytes("abc"), At(70ms));
  ASSERT_EQ(strays_.size(), 1U);
  EXPECT_EQ(strays_[0].count, 3U);
  EXPECT_EQ(strays_[0].since_end, 70ms);
  EXPECT_TRUE(line_.idle());
}

TEST_F(LineTest, QuietBytesRestartTheSilence) {
  Reach(State::quiet);
  line_.Feed(ToBytes("x"), At(1002ms));
  EXPECT_EQ(strays_.size(), 1U);
  EXPECT_EQ(DeadlineIn(), 1007ms);
  line_.OnTimer(At(1007ms));
  EXPECT_EQ(line_.state(), State::sending);
}

TEST_F(LineTest, QuietNeverWaitsBeyondTheCeiling) {
  Reach(State::quiet);
  for (Duration at = 1002ms; at < 1300ms; at += 2ms) line_.Feed(ToBytes("x"), At(at));
  EXPECT_EQ(DeadlineIn(), 1300ms);
  line_.OnTimer(At(1300ms));
  EXPECT_EQ(line_.state(), State::sending) << "a babbling neighbour may not stop the line for ever";
}

TEST_F(LineTest, ACollisionEndsTheExchangeAndDrainsAfterTheTransmission) {
  Reach(State::sending);
  line_.OnCollision(At(1002ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::corrupt);
  EXPECT_EQ(DeadlineIn(), 1004ms + kTimes.drain);
}

TEST_F(LineTest, AClosedConnectionInPlaceOfAReplyIsNoReplyAtOnce) {
  Reach(State::await_first);
  line_.OnEnded(At(1010ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::no_reply);
  EXPECT_TRUE(ends_[0].ended);
  EXPECT_EQ(ends_[0].reason, "the server closed the connection instead of answering");
  EXPECT_EQ(DeadlineIn(), 1010ms + kTimes.drain);
  line_.OnEnded(At(1020ms));
  EXPECT_EQ(ends_.size(), 1U) << "nothing is under way any more";
}

TEST_F(LineTest, SendingTimerAwaitsTheFirstByte) {
  Reach(State::sending);
  line_.OnTimer(At(1006ms));
  EXPECT_EQ(line_.state(), State::await_first);
  EXPECT_EQ(DeadlineIn(), 1104ms);
}

TEST_F(LineTest, BytesAfterABroadcastAreStray) {
  Reach(State::settle);
  line_.Feed(reply_, At(1005ms));
  EXPECT_TRUE(frames_.empty());
  EXPECT_EQ(before_, reply_.size());
}

TEST_F(LineTest, SendingWithoutReplySettlesAndIsOk) {
  Reach(State::settle);
  EXPECT_EQ(line_.state(), State::settle);
  EXPECT_EQ(DeadlineIn(), 1009ms);
  line_.OnTimer(At(1009ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::ok);
  EXPECT_EQ(ends_[0].round_trip, Duration::zero()) << "nobody answered";
  EXPECT_TRUE(line_.idle());
}

TEST_F(LineTest, AwaitFirstBytesAreReceived) {
  Reach(State::await_first);
  line_.Feed(ToBytes("!"), At(1050ms));
  EXPECT_EQ(line_.state(), State::receiving);
  EXPECT_EQ(DeadlineIn(), 1060ms) << "the gap";
}

TEST_F(LineTest, AwaitFirstTimerIsNoReply) {
  Reach(State::await_first);
  line_.OnTimer(At(1104ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::no_reply);
  EXPECT_EQ(ends_[0].round_trip, Duration::zero());
  EXPECT_EQ(line_.state(), State::drain);
  EXPECT_EQ(DeadlineIn(), 1134ms);
}

TEST_F(LineTest, ReceivingWholeFrameIsIdle) {
  Reach(State::await_first);
  line_.Feed(View(reply_).first(3), At(1010ms));
  line_.Feed(View(reply_).subspan(3), At(1015ms));
  EXPECT_EQ(frames_, std::vector<std::string>{std::string(AsText(reply_))});
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::ok);
  EXPECT_EQ(ends_[0].round_trip, 15ms) << "first byte out to last byte in";
  EXPECT_TRUE(line_.idle());
}

TEST_F(LineTest, TheOutcomeOfAWholeFrameDecidesWhetherTheLineDrains) {
  for (const Outcome outcome : {Outcome::busy, Outcome::refused, Outcome::unsupported}) {
    Reach(State::await_first);
    verdict_ = outcome;
    line_.Feed(reply_, At(1015ms));
    EXPECT_EQ(ends_.back().outcome, outcome);
    EXPECT_TRUE(line_.idle()) << Name(outcome);
  }
  Reach(State::await_first);
  verdict_ = Outcome::unexpected;
  line_.Feed(reply_, At(1015ms));
  EXPECT_EQ(ends_.back().outcome, Outcome::unexpected);
  EXPECT_EQ(line_.state(), State::drain);
}

/// The late reply of relay 1 could be mistaken for the reply of relay 2, so the line waits for
/// `aftermath_`. If replies contain an address, waiting for the shorter `drain` suffices.
TEST_F(LineTest, AfterAFailureOnlyDevicesWithUnnamedRepliesGetTheAftermath) {
  aftermath_ = 200ms;
  for (const bool named : {false, true}) {
    named_ = named;
    Reach(State::await_first);
    verdict_ = Outcome::unexpected;
    line_.Feed(reply_, At(1015ms));
    EXPECT_EQ(line_.state(), State::drain);
    EXPECT_EQ(DeadlineIn(), 1015ms + (named ? kTimes.drain : aftermath_));
    line_.OnClosed();
    Reach(State::await_first);
    line_.OnTimer(At(1104ms));
    EXPECT_EQ(DeadlineIn(), 1104ms + kTimes.drain) << "the device itself was silent";
    line_.OnClosed();
  }
}

/// A reply of another device does not end the exchange, because the requested reply can still
/// arrive. A device that is known to answer one request late (`lags`) is an exception.
TEST_F(LineTest, AReplyOfAnotherDeviceEndsOnlyTheExchangeOfALaggingDevice) {
  rule_ = [](View held, const protocols::Expectation&, bool) {
    return protocols::Cut::Discard(held.size(), Outcome::unexpected,
                                   "not from the device that was asked");
  };
  for (const bool lags : {false, true}) {
    lags_ = lags;
    Reach(State::await_first);
    line_.Feed(ToyReply("B1=5"), At(1015ms));
    line_.OnTimer(At(1025ms));
    EXPECT_EQ(line_.state(), lags ? State::drain : State::await_first);
    if (!lags) line_.OnTimer(At(DeadlineIn()));
    EXPECT_EQ(ends_.back().outcome, Outcome::unexpected) << "no silence: somebody has answered";
    line_.OnClosed();
  }
}

TEST_F(LineTest, AReplyEndedBySilenceIsTimedByItsLastByte) {
  rule_ = [](View held, const protocols::Expectation&, bool idle) {
    return idle ? protocols::Cut::Frame(held.size()) : protocols::Cut::NeedMore();
  };
  Reach(State::await_first);
  line_.Feed(reply_, At(1015ms));
  line_.OnTimer(At(1200ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::ok);
  EXPECT_EQ(ends_[0].round_trip, 15ms);
  EXPECT_EQ(ends_[0].since_reply, 185ms);
}

TEST_F(LineTest, ReceivingGapIsPartial) {
  Reach(State::receiving);
  line_.OnTimer(At(1020ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::partial);
  EXPECT_FALSE(ends_[0].reason.empty());
  EXPECT_EQ(line_.state(), State::drain);
}

TEST_F(LineTest, BytesDuringTheDrainExtendItUntilSilence) {
  Reach(State::drain);
  line_.Feed(reply_, At(1120ms));
  EXPECT_TRUE(frames_.empty()) << "a late reply belongs to nobody";
  ASSERT_EQ(strays_.size(), 1U);
  EXPECT_EQ(strays_[0].since_end, 16ms);
  EXPECT_EQ(DeadlineIn(), 1150ms);
  line_.OnTimer(At(1150ms));
  EXPECT_TRUE(line_.idle());
}

TEST_F(LineTest, DrainNeverLastsBeyondTheCeiling) {
  Reach(State::drain);
  for (Duration at = 1105ms; at < 1404ms; at += 3ms) line_.Feed(ToBytes("U"), At(at));
  EXPECT_EQ(DeadlineIn(), 1404ms);
  line_.OnTimer(At(1404ms));
  EXPECT_TRUE(line_.idle());
}

TEST_F(LineTest, TheReplyRuleIsAppliedAgainWhenTheLineIsIdle) {
  Opened();
  Exchange exchange;
  exchange.request.bytes = ToBytes("?");
  exchange.times = kTimes;
  exchange.reply_rule = [](View held, const protocols::Expectation&, bool idle) {
    return idle ? protocols::Cut::Frame(held.size()) : protocols::Cut::NeedMore();
  };
  line_.Start(std::move(exchange), At(1s));
  line_.OnTimer(At(1001ms));
  line_.Feed(ToBytes("undelimited"), At(1010ms));
  EXPECT_TRUE(frames_.empty());
  line_.OnTimer(At(1020ms));
  EXPECT_EQ(frames_, std::vector<std::string>{"undelimited"});
  EXPECT_EQ(ends_.at(0).outcome, Outcome::ok);
}

TEST_F(LineTest, ASecondExchangeKeepsNoBytesOfTheFirst) {
  Reach(State::await_first);
  Bytes twice = reply_;
  Append(twice, View(reply_).first(4));
  line_.Feed(twice, At(1010ms));
  Start(1100ms);
  line_.OnTimer(At(1104ms));
  EXPECT_EQ(frames_.size(), 1U);
  line_.Feed(View(reply_).subspan(4), At(1110ms));
  line_.OnTimer(At(1120ms));
  EXPECT_EQ(frames_.size(), 1U) << "the head of a reply was kept from the exchange before";
  EXPECT_EQ(ends_.back().outcome, Outcome::corrupt);
}

}  // namespace
}  // namespace baudgate::bus
