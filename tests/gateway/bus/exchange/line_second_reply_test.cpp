// What the line does about a second reply; which bytes are one: second_reply_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/bus/exchange/line_fixture.h"

namespace baudgate {
namespace {

TEST_F(LineTest, BytesBehindAFrameAreStrayAndDrained) {
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
  EXPECT_EQ(line_.state(), State::drain);
}

TEST_F(LineTest, TheSameReplyTwiceIsOne) {
  Reach(State::await_first);
  Bytes both = reply_;
  Append(both, View(reply_));
  line_.Feed(both, At(1015ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::ok);
  line_.Feed(reply_, At(1030ms));
  EXPECT_EQ(second_, 0);
}

TEST_F(LineTest, AnotherReplyBehindTheOneThatWasTakenIsTold) {
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

}  // namespace
}  // namespace baudgate
