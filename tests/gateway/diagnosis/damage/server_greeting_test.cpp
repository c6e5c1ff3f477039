// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/diagnosis/damage/examiner.h"

namespace baudgate {
namespace {

class ServerGreetingTest : public ::testing::Test {
 protected:
  const Bytes login_ = ToBytes("Login: ");
  const Bytes reply_ = ToBytes("A1=5\r");
  ServerGreeting greeting_;
};

TEST_F(ServerGreetingTest, IsWhatComesBeforeTheFirstRequestOrMeetsIt) {
  greeting_.Keep(login_);
  greeting_.NoteExchange({}, false);
  EXPECT_EQ(greeting_.text(), login_);
  greeting_.OnOpened();
  EXPECT_TRUE(greeting_.text().empty());
  greeting_.NoteExchange(login_, true);
  EXPECT_EQ(greeting_.text(), login_);
}

TEST_F(ServerGreetingTest, WordsInALaterExchangeAreNone) {
  greeting_.NoteExchange({}, false);
  greeting_.NoteExchange(login_, true);
  EXPECT_TRUE(greeting_.text().empty());
}

TEST_F(ServerGreetingTest, HasKeptNobodyFromAnsweringOnceADeviceHasAnswered) {
  greeting_.Keep(login_);
  EXPECT_EQ(greeting_.OnAnswered(reply_), login_);
  greeting_.NoteExchange(reply_, false);
  EXPECT_TRUE(greeting_.text().empty());
}

TEST_F(ServerGreetingTest, OneThatMeetsTheFirstRequestComesWithItsReply) {
  EXPECT_EQ(greeting_.OnAnswered(reply_), reply_);
  greeting_.NoteExchange(reply_, false);
  EXPECT_TRUE(greeting_.OnAnswered(reply_).empty());
}

}  // namespace
}  // namespace baudgate
