// Every kind of fault in every state of the line: loss, babble, timers too early and too late.
// SPDX-License-Identifier: Apache-2.0
#include <malloc.h>

#include "tests/gateway/bus/exchange/line_fixture.h"

namespace baudgate {
namespace {

/// What a line may hold of all that comes.
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

TEST_P(EveryState, NoBytesAreNoEvent) {
  Reach(GetParam());
  const auto deadline = line_.Deadline();
  line_.Feed({}, At(1030ms));
  EXPECT_EQ(line_.state(), GetParam());
  EXPECT_EQ(line_.Deadline(), deadline);
  EXPECT_TRUE(strays_.empty());
}

TEST_P(EveryState, EndlessBabbleHoldsNeitherTheLineNorMemory) {
  Reach(GetParam());
  const bool under_way = line_.Deadline().has_value();
  const Bytes noise(64, 'U');
  bool idle_again = false;
  const std::size_t before = HeapInUse();
  for (Duration at = 1010ms; at < 3s; at += 1ms) {
    while (line_.Deadline() && DeadlineIn() <= at) line_.OnTimer(*line_.Deadline());
    idle_again = idle_again || line_.idle();
    line_.Feed(noise, At(at));
    strays_.clear();  // the test keeps these
    ASSERT_LE(HeapInUse(), before + kLittle);
  }
  EXPECT_EQ(idle_again, under_way || GetParam() == State::idle);
  EXPECT_TRUE(frames_.empty());
}

TEST_P(EveryState, AVeryLateTimerIsAsGoodAsOneInTime) {
  Reach(GetParam());
  for (int i = 0; i < 10 && line_.Deadline(); ++i) line_.OnTimer(At(1h));
  // Times that count from the late event itself (a drain) come due in turn.
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
}  // namespace baudgate
