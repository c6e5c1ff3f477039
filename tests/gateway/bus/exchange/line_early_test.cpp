// Tests of `Line` with replies that are early, late, damaged or doubled. Bytes before the end of a
// request can be its reply only if the port does not keep its bit rate, like a serial server.
// SPDX-License-Identifier: Apache-2.0
#include <malloc.h>

#include <algorithm>

#include "tests/gateway/bus/exchange/line_fixture.h"

namespace baudgate::bus {
namespace {

TEST_F(LineTest, AWholeReplyEndsTheSendingOnAPortWithoutBitRate) {
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

TEST_F(LineTest, APossibleEchoIsJudgedAtTheEndOfTransmission) {
  Opened();
  mirrors_ = true;
  Start(1s);
  line_.Feed(reply_, At(1001ms));
  EXPECT_TRUE(frames_.empty());
  line_.OnTimer(At(1004ms));
  EXPECT_EQ(frames_.size(), 1U);
}

TEST_F(LineTest, EarlyBytesAreStrayOnAPortThatKeepsItsBitRate) {
  line_.OnOpened(At(0ms), true);
  Start(1s);
  line_.Feed(ToyReply("A1=4"), At(1002ms));
  line_.OnTimer(At(1004ms));
  EXPECT_TRUE(frames_.empty());
  line_.Feed(reply_, At(1020ms));
  ASSERT_EQ(frames_.size(), 1U);
  EXPECT_EQ(frames_[0], AsText(reply_));
  ASSERT_EQ(strays_.size(), 1U);
  EXPECT_EQ(strays_[0].count, ToyReply("A1=4").size());
  EXPECT_EQ(before_, ToyReply("A1=4").size());
}

TEST_F(LineTest, APossibleEchoIsNotAcceptedAsAnEarlyReply) {
  line_.OnOpened(At(0ms), true);
  mirrors_ = true;
  Start(1s);
  line_.Feed(reply_, At(1002ms));
  line_.OnTimer(At(1004ms));
  line_.OnTimer(At(1104ms));
  EXPECT_TRUE(frames_.empty());
  EXPECT_EQ(ends_.back().outcome, Outcome::no_reply);
}

TEST_F(LineTest, BytesDuringABroadcastAreNotAReply) {
  Opened();
  Start(1s, "QA1\r");
  line_.Feed(reply_, At(1001ms));
  EXPECT_TRUE(frames_.empty());
  EXPECT_EQ(line_.state(), State::sending);
}

TEST_F(LineTest, TheAftermathOfAnEarlyReplyCountsFromTheEndOfTransmission) {
  aftermath_ = 200ms;
  Reach(State::sending);
  line_.Feed(reply_, At(1002ms));
  EXPECT_EQ(line_.state(), State::drain);
  EXPECT_EQ(DeadlineIn(), 1004ms + aftermath_);
}

TEST_F(LineTest, APortThatDoesNotKeepItsClaimedBitRateIsDetected) {
  line_.OnOpened(At(0ms), true);
  Start(1s);
  line_.Feed(reply_, At(1002ms));
  line_.OnTimer(At(1004ms));
  EXPECT_TRUE(frames_.empty());
  line_.OnTimer(At(1104ms));
  ASSERT_EQ(frames_.size(), 1U);
  EXPECT_EQ(ends_.back().outcome, Outcome::ok);
  Start(2s);
  line_.Feed(reply_, At(2002ms));
  line_.OnTimer(At(2004ms));
  EXPECT_EQ(frames_.size(), 2U) << "from now on at once";
}

/// The timer comes 4 s late, as after SIGSTOP, so the age of the early reply is unknown.
TEST_F(LineTest, AnEarlyReplyIsDroppedWhenTheTimerIsVeryLate) {
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

TEST_F(LineTest, AReplyIsAcceptedWhenTheTransmissionTimerIsLate) {
  line_.OnOpened(At(0ms), true);
  Start(1s);
  line_.Feed(reply_, At(1015ms));
  ASSERT_EQ(frames_.size(), 1U);
}

TEST_F(LineTest, AReplyReadLongAfterTheReplyTimeIsStray) {
  Reach(State::await_first);
  line_.Feed(reply_, At(5s));
  EXPECT_TRUE(frames_.empty()) << "nobody knows when it came";
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::no_reply);
  EXPECT_EQ(strays_.size(), 1U);
}

TEST_F(LineTest, AReplyLessThan100MsAfterItsReplyTimeIsAccepted) {
  Reach(State::await_first);
  line_.Feed(reply_, At(1104ms + 99ms));
  EXPECT_EQ(frames_.size(), 1U);
  Reach(State::await_first);
  line_.Feed(reply_, At(1104ms + 100ms));
  EXPECT_EQ(frames_.size(), 1U);
}

TEST_F(LineTest, AReplyReadLongAfterTheEndOfTransmissionIsDropped) {
  Reach(State::sending);
  line_.Feed(reply_, At(5s));
  EXPECT_TRUE(frames_.empty());
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::no_reply);
}

TEST_F(LineTest, TheRestOfAReplyReadBeyondTheCeilingIsCorrupt) {
  Reach(State::await_first);
  line_.Feed(View(reply_).first(3), At(1015ms));
  line_.Feed(View(reply_).subspan(3), At(5s));
  EXPECT_TRUE(frames_.empty());
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::corrupt) << "beyond the longest time";
}

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

TEST_F(LineTest, AGoodFrameAfterDamageIsAccepted) {
  Reach(State::await_first);
  line_.Feed(ToBytes("zz"), At(1010ms));
  line_.Feed(reply_, At(1015ms));
  EXPECT_EQ(ends_.at(0).outcome, Outcome::ok);
}

TEST_F(LineTest, HarmlessNoiseDoesNotShortenTheReplyTime) {
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

TEST_F(LineTest, BytesAfterAFrameAreStrayAndDrained) {
  Reach(State::await_first);
  Bytes twice = reply_;
  Append(twice, reply_);
  line_.Feed(twice, At(1010ms));
  EXPECT_EQ(frames_.size(), 1U);
  ASSERT_EQ(strays_.size(), 1U);
  EXPECT_EQ(strays_[0].count, reply_.size());
  EXPECT_EQ(line_.state(), State::drain);
}

TEST_F(LineTest, TwoDifferentRepliesAtOnceAreUnexpected) {
  Reach(State::await_first);
  Bytes both = reply_;
  Append(both, ToyReply("A1=6"));
  line_.Feed(both, At(1015ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::unexpected);
  EXPECT_FALSE(ends_[0].reason.empty());
  EXPECT_TRUE(frames_.empty()) << "nobody knows which is the awaited one";
  EXPECT_EQ(second_, 1);
  EXPECT_EQ(line_.state(), State::drain);
}

TEST_F(LineTest, ARepeatedEqualReplyIsNotASecondReply) {
  Reach(State::await_first);
  Bytes both = reply_;
  Append(both, View(reply_));
  line_.Feed(both, At(1015ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::ok);
  line_.Feed(reply_, At(1030ms));
  EXPECT_EQ(second_, 0);
}

/// A console answers "5\r" and then an empty line "\r", in the same read or later.
TEST_F(LineTest, AnEmptyLineAfterAReplyIsNotASecondReply) {
  rule_ = [](View held, const protocols::Expectation&, bool) {
    const auto end = std::find(held.begin(), held.end(), '\r');
    if (end == held.end()) return protocols::Cut::NeedMore();
    return protocols::Cut::Frame(static_cast<std::size_t>(end - held.begin()) + 1);
  };
  Reach(State::await_first);
  line_.Feed(ToBytes("5\r\r"), At(1015ms));
  EXPECT_EQ(ends_.back().outcome, Outcome::ok);
  line_.Feed(ToBytes("\r"), At(1020ms));
  EXPECT_EQ(second_, 0);
  line_.Feed(ToBytes("6\r"), At(1025ms));
  EXPECT_EQ(second_, 1);
}

TEST_F(LineTest, AReplyAfterARejectedReplyIsNotASecondReply) {
  Reach(State::await_first);
  verdict_ = Outcome::unexpected;
  line_.Feed(reply_, At(1015ms));
  line_.Feed(ToyReply("A1=6"), At(1030ms));
  EXPECT_EQ(second_, 0);
}

TEST_F(LineTest, NoDrainFollowsHarmlessCopies) {
  struct Case {
    bool any_order;
    bool numbered;
    Bytes behind;
    State follows;
  };
  const Case cases[] = {{true, false, reply_, State::idle},
                        {false, true, reply_, State::idle},
                        {true, false, ToBytes("!"), State::drain},
                        {false, false, reply_, State::drain}};
  for (const Case& one : cases) {
    any_order_ = one.any_order;
    numbered_ = one.numbered;
    Reach(State::await_first);
    Bytes both = reply_;
    Append(both, one.behind);
    line_.Feed(both, At(1015ms));
    EXPECT_EQ(line_.state(), one.follows) << one.any_order << one.numbered;
    line_.OnClosed();
  }
}

TEST_F(LineTest, ADifferentReplyAfterTheAcceptedReplyIsReportedOnce) {
  Reach(State::await_first);
  line_.Feed(reply_, At(1015ms));
  EXPECT_TRUE(line_.idle());
  const Bytes other = ToyReply("A1=6");
  line_.Feed(View(other).first(3), At(1030ms));
  EXPECT_EQ(second_, 0);
  Start(1031ms);
  EXPECT_EQ(line_.state(), State::quiet);
  line_.Feed(View(other).subspan(3), At(1033ms));
  EXPECT_EQ(second_, 1);
  line_.Feed(other, At(1034ms));
  EXPECT_EQ(second_, 1) << "told once";
}

TEST_F(LineTest, ADifferentReplyDuringTheNextRequestIsReported) {
  line_.OnOpened(At(0ms), true);
  Start(1s);
  line_.OnTimer(At(1004ms));
  line_.Feed(reply_, At(1015ms));
  Start(1030ms);
  ASSERT_EQ(line_.state(), State::sending);
  line_.Feed(ToyReply("A1=6"), At(1031ms));
  EXPECT_EQ(second_, 0) << "it may be the reply of a port that does not keep its bit rate";
  line_.OnTimer(At(1034ms));
  line_.Feed(reply_, At(1045ms));
  EXPECT_EQ(second_, 1);
  EXPECT_EQ(ends_.back().outcome, Outcome::ok);
  Start(1100ms);
  line_.Feed(reply_, At(1101ms));
  line_.OnTimer(At(1104ms));
  line_.Feed(reply_, At(1115ms));
  EXPECT_EQ(second_, 1) << "a copy is no second reply";
}

constexpr std::size_t kLittle = 16'384;

std::size_t HeapInUse() { return mallinfo2().uordblks; }

class EveryState : public LineTest, public ::testing::WithParamInterface<State> {};

TEST_P(EveryState, LossOfThePortClosesAndEndsTheExchangeOnce) {
  const State state = GetParam();
  Reach(state);
  ASSERT_EQ(line_.state(), state);
  line_.OnClosed();
  const bool under_way = state != State::closed && state != State::idle && state != State::quiet &&
                         state != State::drain;
  ASSERT_EQ(ends_.size(), under_way ? 1U : 0U);
  if (under_way) {
    EXPECT_EQ(ends_[0].outcome, Outcome::line_down);
  }
  EXPECT_EQ(line_.state(), State::closed);
  EXPECT_FALSE(line_.Deadline());
  line_.OnClosed();
  line_.OnTimer(At(5s));
  line_.Feed(reply_, At(5s));
  EXPECT_EQ(ends_.size(), under_way ? 1U : 0U);
  EXPECT_TRUE(frames_.empty());
}

TEST_P(EveryState, ReopenedLineWorks) {
  Reach(GetParam());
  line_.OnClosed();
  ends_.clear();
  line_.OnOpened(At(2s));
  Start(3s);
  line_.OnTimer(At(3004ms));
  line_.Feed(reply_, At(3010ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::ok);
}

TEST_P(EveryState, AnEarlyTimerDoesNothing) {
  Reach(GetParam());
  const auto deadline = line_.Deadline();
  if (deadline) line_.OnTimer(*deadline - 1ns);
  EXPECT_EQ(line_.state(), GetParam());
  EXPECT_EQ(line_.Deadline(), deadline);
  EXPECT_TRUE(ends_.empty());
}

TEST_P(EveryState, AnEmptyReadChangesNothing) {
  Reach(GetParam());
  const auto deadline = line_.Deadline();
  line_.Feed({}, At(1030ms));
  EXPECT_EQ(line_.state(), GetParam());
  EXPECT_EQ(line_.Deadline(), deadline);
  EXPECT_TRUE(strays_.empty());
}

TEST_P(EveryState, EndlessBabbleNeitherBlocksTheLineNorGrowsMemory) {
  Reach(GetParam());
  const bool under_way = line_.Deadline().has_value();
  const Bytes noise(64, 'U');
  bool idle_again = false;
  const std::size_t before = HeapInUse();
  for (Duration at = 1010ms; at < 3s; at += 1ms) {
    while (line_.Deadline() && DeadlineIn() <= at) line_.OnTimer(*line_.Deadline());
    idle_again = idle_again || line_.idle();
    line_.Feed(noise, At(at));
    strays_.clear();  // the test itself stores these bytes, so they must not be counted
    ASSERT_LE(HeapInUse(), before + kLittle);
  }
  EXPECT_EQ(idle_again, under_way || GetParam() == State::idle);
  EXPECT_TRUE(frames_.empty());
}

TEST_P(EveryState, AVeryLateTimerLeadsToTheSameStateAsATimelyTimer) {
  Reach(GetParam());
  for (int i = 0; i < 10 && line_.Deadline(); ++i) line_.OnTimer(At(1h));
  for (int i = 0; i < 10 && line_.Deadline(); ++i) line_.OnTimer(*line_.Deadline());
  EXPECT_EQ(line_.state(), GetParam() == State::closed ? State::closed : State::idle);
}

TEST(LineFlood, BytesDuringALongTransmissionStayBounded) {
  struct Deaf final : LineClient {
    Outcome Judge(View, Instant) override { return Outcome::ok; }
  } client;
  Line line(client);
  line.OnOpened(kStart);
  Exchange exchange;
  exchange.request.bytes = Bytes(250, '?');
  exchange.reply_rule = ToyProtocol().reply_rule;
  exchange.times = kTimes;
  line.Start(std::move(exchange), kStart + 1s);
  const Bytes flood(4096, 'U');
  const std::size_t before = HeapInUse();
  for (int i = 0; i < 1000; ++i) line.Feed(flood, kStart + 1001ms);
  EXPECT_LE(HeapInUse(), before + kLittle) << "a pty floods faster than any wire";
}

INSTANTIATE_TEST_SUITE_P(Line, EveryState,
                         ::testing::Values(State::closed, State::idle, State::quiet, State::sending,
                                           State::settle, State::await_first, State::receiving,
                                           State::drain));

}  // namespace
}  // namespace baudgate::bus
