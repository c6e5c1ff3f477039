// Replies that waited while nobody ran: nobody knows when they came.
// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/bus/exchange/line_fixture.h"

namespace baudgate {
namespace {

TEST_F(LineTest, AReplyThatWaitedWhileNobodyRanIsTooLate) {
  Reach(State::await_first);
  line_.Feed(reply_, At(5s));
  EXPECT_TRUE(frames_.empty()) << "nobody knows when it came";
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::no_reply);
  EXPECT_EQ(strays_.size(), 1U);
}

TEST_F(LineTest, AReplyToARequestWhoseEndNobodySawIsTooLateAlike) {
  Reach(State::sending);
  line_.Feed(reply_, At(5s));
  EXPECT_TRUE(frames_.empty());
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::no_reply);
}

TEST_F(LineTest, TheRestOfAReplyThatWaitedAlike) {
  Reach(State::await_first);
  line_.Feed(View(reply_).first(3), At(1015ms));
  line_.Feed(View(reply_).subspan(3), At(5s));
  EXPECT_TRUE(frames_.empty());
  ASSERT_EQ(ends_.size(), 1U);
  EXPECT_EQ(ends_[0].outcome, Outcome::corrupt) << "beyond the ceiling";
}

}  // namespace
}  // namespace baudgate
