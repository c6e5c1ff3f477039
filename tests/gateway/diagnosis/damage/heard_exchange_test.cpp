// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"
#include "gateway/diagnosis/damage/reply_habits.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class HeardExchangeTest : public ::testing::Test, protected ToyMembers {
 protected:
  HeardExchangeTest() { exchange_.Begin(a, AskFor("?A1\r"), a.times, kStart); }

  std::string Before() { return ToText(exchange_.BesideReply().first); }
  std::string Behind() { return ToText(exchange_.BesideReply().second); }
  static std::string ToText(View bytes) { return {bytes.begin(), bytes.end()}; }

  HeardExchange exchange_;
};

TEST_F(HeardExchangeTest, WhatStandsBesideTheReplyIsWhatWasHeardBeforeAndBehindIt) {
  exchange_.Hear(ToBytes("xA1=5\r\ny"), kStart + 50ms);
  EXPECT_EQ(Before(), "xA1=5\r\ny");
  exchange_.Take(ToBytes("A1=5"));
  EXPECT_EQ(Before(), "x");
  EXPECT_EQ(Behind(), "y");
}

TEST_F(HeardExchangeTest, MoreIsToldOnceAndOnlyBehindItsEnd) {
  exchange_.Hear(ToBytes("A1"), kStart + 50ms);
  EXPECT_FALSE(exchange_.TakeMore());
  exchange_.End(Outcome::partial);
  EXPECT_FALSE(exchange_.TakeMore());
  exchange_.Hear(ToBytes("=5"), kStart + 90ms);
  EXPECT_TRUE(exchange_.TakeMore());
  EXPECT_FALSE(exchange_.TakeMore());
}

TEST_F(HeardExchangeTest, TheSilenceBeforeItCountsFromTheLatestByteInOrOut) {
  EXPECT_EQ(exchange_.idle(), kLongIdle);
  exchange_.Hear(ToBytes("A1=5\r"), kStart + 50ms);
  exchange_.Begin(a, AskFor("?A2\r"), a.times, kStart + 80ms);
  EXPECT_EQ(exchange_.idle(), 30ms);
  EXPECT_TRUE(exchange_.heard().empty());
}

TEST_F(HeardExchangeTest, KeepsNoMoreThanALongReply) {
  for (int i = 0; i < 1000; ++i) exchange_.Hear(ToBytes("0123456789"), kStart + i * 1ms);
  EXPECT_EQ(exchange_.heard().size(), 1024U);
  EXPECT_LE(exchange_.arrivals().size(), 256U);
}

}  // namespace
}  // namespace baudgate
