// How long a device that answers late is waited for, reply by reply.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/replies/late_replies.h"
#include "tests/gateway/bus/poller/part_fixture.h"

namespace baudgate {
namespace {

class PatienceTest : public ::testing::Test, protected ToyMembers {
 protected:
  PatienceTest() {
    a.times.reply = 300ms;
    a.times.gap = 20ms;
    a.times.ceiling = 1s;
  }
  Patience patience_;
};

TEST_F(PatienceTest, OneLateReplyIsChanceAndTwoAreNot) {
  patience_.OnLate(a, 150ms);
  EXPECT_EQ(patience_.More(a), 0ms);
  patience_.OnLate(a, 100ms);
  EXPECT_EQ(patience_.More(a), 187500us) << "a quarter more than the latest of them";
  EXPECT_EQ(patience_.More(b), 0ms);
}

TEST_F(PatienceTest, TwoThatAreFarApartAreChanceAsWell) {
  patience_.OnLate(a, 150ms);
  for (int i = 0; i < 100; ++i) patience_.OnAnswered(a, -280ms);
  patience_.OnLate(a, 150ms);
  EXPECT_EQ(patience_.More(a), 0ms);
}

TEST_F(PatienceTest, EndsWithTheCeiling) {
  patience_.OnLate(a, 600ms);
  patience_.OnLate(a, 600ms);
  EXPECT_EQ(patience_.More(a), 680ms) << "which has room for a gap as well";
}

TEST_F(PatienceTest, IsNotEarnedByRepliesThatComeBehindTheCeiling) {
  for (int i = 0; i < 5; ++i) patience_.OnLate(a, 681ms);
  EXPECT_EQ(patience_.More(a), 0ms) << "no wait within the ceiling would have met them";
}

TEST_F(PatienceTest, ShrinksSlowlyAndNotWhileItIsNeeded) {
  patience_.OnLate(a, 160ms);
  patience_.OnLate(a, 160ms);
  for (int i = 0; i < 200; ++i) patience_.OnAnswered(a, -280ms);
  EXPECT_GT(patience_.More(a), 160ms);
  patience_.OnAnswered(a, 160ms);
  EXPECT_EQ(patience_.More(a), 200ms);
  for (int i = 0; i < 10'000; ++i) patience_.OnAnswered(a, -280ms);
  EXPECT_EQ(patience_.More(a), 0ms);
}

TEST_F(PatienceTest, IsNoneForADeviceThatHasGone) {
  patience_.OnLate(a, 160ms);
  patience_.OnLate(a, 160ms);
  patience_.OnOffline(a);
  EXPECT_EQ(patience_.More(a), 0ms);
}

}  // namespace
}  // namespace baudgate
