// What comes behind a reply, or together with it: copies, another reply, noise.
// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/line/line_fixture.h"

namespace baudgate {
namespace {

TEST_F(LineTest, BytesBehindAFrameAreStrayAndDrained) {
  Reach(State::await_first);
  Bytes twice = reply_;
  Append(twice, reply_);
  line_.OnBytes(twice, At(1010ms));
  EXPECT_EQ(frames_.size(), 1U);
  ASSERT_EQ(strays_.size(), 1U);
  EXPECT_EQ(strays_[0].count, reply_.size());
  EXPECT_EQ(line_.state(), State::drain);
}

TEST_F(LineTest, TwoDifferentRepliesAtOnceAreUnexpected) {
  Reach(State::await_first);
  Bytes both = reply_;
  Append(both, ToyReply("A1=6"));
  line_.OnBytes(both, At(1015ms));
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
  line_.OnBytes(both, At(1015ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::ok);
  line_.OnBytes(reply_, At(1030ms));
  EXPECT_EQ(second_, 0);
}

TEST_F(LineTest, AnotherReplyBehindTheOneThatWasTakenIsTold) {
  Reach(State::await_first);
  line_.OnBytes(reply_, At(1015ms));
  EXPECT_TRUE(line_.idle());
  const Bytes other = ToyReply("A1=6");
  line_.OnBytes(View(other).first(3), At(1030ms));
  EXPECT_EQ(second_, 0);
  Start(1031ms);
  EXPECT_EQ(line_.state(), State::quiet);
  line_.OnBytes(View(other).subspan(3), At(1033ms));
  EXPECT_EQ(second_, 1);
  line_.OnBytes(other, At(1034ms));
  EXPECT_EQ(second_, 1) << "told once";
}

TEST_F(LineTest, CopiesOfAReplyDoNoHarm) {
  Reach(State::await_first);
  Bytes both = reply_;
  Append(both, View(reply_));
  line_.OnBytes(both, At(1015ms));
  line_.OnBytes(reply_, At(1060ms));
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::ok);
  EXPECT_EQ(second_, 0);
}

TEST_F(LineTest, AnotherReplyIsFoundBehindAnyNumberOfCopies) {
  Reach(State::await_first);
  line_.OnBytes(reply_, At(1015ms));
  Bytes flood;
  for (int i = 0; i < 100; ++i) Append(flood, reply_);
  line_.OnBytes(flood, At(1030ms));
  EXPECT_EQ(second_, 0);
  line_.OnBytes(ToyReply("A1=6"), At(1031ms));
  EXPECT_EQ(second_, 1) << "nothing is held back";
}

TEST_F(LineTest, NoiseBehindAReplyIsNoOther) {
  Reach(State::await_first);
  line_.OnBytes(reply_, At(1015ms));
  line_.OnBytes(ToBytes("\x00!A1=\xFF"), At(1030ms));
  line_.OnBytes(Bytes(4096, 'U'), At(1040ms));
  EXPECT_EQ(second_, 0);
}

}  // namespace
}  // namespace baudgate
