// How the replies of a device look in general.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/reply_habits.h"

#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class ReplyHabitsTest : public ::testing::Test, protected ToyMembers {
 protected:
  /// `own`: the reply that is taken; empty: none.
  void Exchange(std::string_view asked, const std::vector<Bytes>& came, const Bytes& own = {}) {
    exchange_.Begin(a, AskFor(asked), a.times, kStart);
    habits_.OnBegin(a);
    for (const Bytes& bytes : came) exchange_.Hear(bytes, kStart + 50ms);
    if (!own.empty()) exchange_.Take(own);
    exchange_.End(own.empty() ? Outcome::corrupt : Outcome::ok);
    if (!own.empty()) habits_.OnAnswered(exchange_);
  }

  const Bytes one_ = ToyReply("A1=5");
  const Bytes two_ = ToyReply("A2=6");
  HeardExchange exchange_;
  ReplyHabits habits_;
};

TEST_F(ReplyHabitsTest, ASecondReplyBehindALostTryWasLateAndElseTheDeviceSendsTwo) {
  habits_.OnBegin(a);
  habits_.OnLost(a, kStart);
  habits_.OnBegin(a);
  const auto lost = habits_.TakeLostTry(a, kStart + 2s);
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->after, 2s);
  EXPECT_EQ(lost->back, 2U);
  EXPECT_FALSE(habits_.TakeLostTry(a, kStart + 2s)) << "it was taken";
  habits_.OnLost(a, kStart + 3s);
  EXPECT_FALSE(habits_.TakeLostTry(a, kStart + 4s)) << "it is known to send two";
}

TEST_F(ReplyHabitsTest, ALostTryIsForgottenAfterFiveSeconds) {
  habits_.OnLost(a, kStart);
  EXPECT_FALSE(habits_.TakeLostTry(a, kStart + 5s));
}

TEST_F(ReplyHabitsTest, AReplyThatWasTakenForAnotherRequestIsACopy) {
  Exchange("?A1\r", {one_}, one_);
  Exchange("?A2\r", {one_, two_}, two_);
  EXPECT_TRUE(habits_.IsCopy(exchange_));
  Exchange("?A2\r", {ToyReply("A1=8"), two_}, two_);
  EXPECT_FALSE(habits_.IsCopy(exchange_)) << "it was not taken before";
}

/// The second time in a row it is no damage: the device sends that form.
TEST_F(ReplyHabitsTest, ATextThatLacksTheSameCharacterAgainIsOfAnotherForm) {
  const Finding lacks{.symptom = Symptom::bytes_lost, .cause = "a character"};
  Exchange("?A1\r", {ToBytes("!A1=*C1\r")});
  EXPECT_EQ(habits_.Compare(exchange_, lacks).symptom, Symptom::bytes_lost);
  EXPECT_EQ(habits_.Compare(exchange_, lacks).symptom, Symptom::other_form);
  Exchange("?A1\r", {one_}, one_);
  Exchange("?A1\r", {ToBytes("!A1=*C1\r")});
  EXPECT_EQ(habits_.Compare(exchange_, lacks).symptom, Symptom::bytes_lost) << "it was good since";
}

}  // namespace
}  // namespace baudgate
