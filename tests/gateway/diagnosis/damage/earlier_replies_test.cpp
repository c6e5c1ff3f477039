// Replies that belong to an earlier exchange: the rows of
// gateway/diagnosis/damage/earlier_replies.h.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/earlier_replies.h"

#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class EarlierRepliesTest : public ::testing::Test, protected ToyMembers {
 protected:
  /// An exchange of 1 s. `came`: in the order in which it comes; `own`: which of these is the
  /// reply.
  void Exchange(const Member& member, std::string_view asked,
                const std::vector<std::string_view>& came = {}, std::string_view own = {}) {
    exchange_.Begin(member, AskFor(asked), member.times, now_);
    earlier_.OnBegin(exchange_, {});
    for (const std::string_view body : came) exchange_.Hear(ToyReply(body), now_ + 50ms);
    if (!own.empty()) exchange_.Take(ToyReply(own));
    exchange_.End(own.empty() ? Outcome::no_reply : Outcome::ok);
    if (!own.empty()) earlier_.OnAnswered(exchange_);
    earlier_.NoteSilence(exchange_);
    now_ += 1s;
  }
  Finding Attribute(Symptom symptom) { return earlier_.Attribute(exchange_, {.symptom = symptom}); }

  HeardExchange exchange_;
  ReplyHabits habits_;
  EarlierReplies earlier_{habits_};
  Instant now_ = kStart;
};

TEST_F(EarlierRepliesTest, ALateReplyOfAnotherIsToldOfThatExchange) {
  Exchange(a, "?A1\r");
  Exchange(b, "?B1\r", {"A1=5", "B1=7"}, "B1=7");
  EXPECT_EQ(Attribute(Symptom::device_beside).symptom, Symptom::clean);
  const auto earlier = earlier_.Take();
  ASSERT_TRUE(earlier);
  EXPECT_EQ(earlier->member, &a);
  EXPECT_EQ(earlier->finding.symptom, Symptom::late);
  EXPECT_GT(earlier->lateness, 800ms);
  EXPECT_FALSE(earlier_.Take());
}

/// "!A1" comes late while "?A2" is out, and "!A2" while "?B1" is.
TEST_F(EarlierRepliesTest, EachOfTwoLateRepliesIsToldOfItsOwnRequest) {
  Exchange(a, "?A1\r");
  Exchange(a, "?A2\r", {"A1=5"});
  EXPECT_EQ(Attribute(Symptom::other_reply).symptom, Symptom::late);
  Exchange(b, "?B1\r", {"A2=6"});
  EXPECT_EQ(Attribute(Symptom::other_device).symptom, Symptom::late_other);
  const auto second = earlier_.Take();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->member, &a);
  EXPECT_GT(second->lateness, 800ms);
}

TEST_F(EarlierRepliesTest, OneInPlaceOfTheOwnSaysWhoseItIs) {
  Exchange(a, "?A1\r");
  Exchange(b, "?B1\r", {"A1=5"});
  const Finding finding = Attribute(Symptom::other_device);
  EXPECT_EQ(finding.symptom, Symptom::late_other);
  EXPECT_EQ(finding.cause, "a");
}

TEST_F(EarlierRepliesTest, OneThatWasTakenBeforeHasComeAgain) {
  Exchange(a, "?A1\r", {"A1=5"}, "A1=5");
  Exchange(a, "?A2\r", {"A1=5", "A2=6"}, "A2=6");
  EXPECT_EQ(Attribute(Symptom::noise_before).symptom, Symptom::copies);
  Exchange(a, "?A1\r", {"A2=7", "A1=5"}, "A1=5");
  EXPECT_EQ(Attribute(Symptom::noise_before).symptom, Symptom::others_beside) << "it differs";
  EXPECT_FALSE(earlier_.Take());
}

TEST_F(EarlierRepliesTest, WhatAnswersNoRequestIsLeftAsItIs) {
  Exchange(a, "?A1\r", {"C1=5"});
  EXPECT_EQ(Attribute(Symptom::other_device).symptom, Symptom::other_device);
}

TEST_F(EarlierRepliesTest, ARequestThatComesBackLateIsNoOtherMasters) {
  Exchange(a, "?A1\r");
  exchange_.Begin(b, AskFor("?B1\r"), b.times, now_);
  earlier_.OnBegin(exchange_, {});
  exchange_.Hear(ToBytes("?A2\r"), now_ + 50ms);
  EXPECT_FALSE(earlier_.IsLateEcho(exchange_));
  exchange_.Hear(ToBytes("?A1\r"), now_ + 60ms);
  EXPECT_TRUE(earlier_.IsLateEcho(exchange_));
}

/// "A1" is silent and asked again; two replies follow, one of them to the first try.
TEST_F(EarlierRepliesTest, OfTwoRepliesBehindALostTryOneWasLate) {
  Exchange(a, "?A1\r");
  Exchange(a, "?A1\r", {"A1=5"}, "A1=5");
  Exchange(a, "?A2\r", {"A1=6", "A2=7"}, "A2=7");
  const auto late = earlier_.FindLostTry(a, now_);
  ASSERT_TRUE(late);
  EXPECT_EQ(late->symptom, Symptom::late);
  EXPECT_EQ(earlier_.Take()->back, 2U);
  EXPECT_FALSE(earlier_.FindLostTry(a, now_)) << "each is taken once";
}

/// The rest of "!A1=5" comes in the exchange behind it.
TEST_F(EarlierRepliesTest, TheRestOfABrokenReplyIsFoundInALaterExchange) {
  const Bytes whole = ToyReply("A1=5");
  exchange_.Begin(a, AskFor("?A1\r"), a.times, now_);
  earlier_.OnBegin(exchange_, {});
  exchange_.Hear(View(whole).first(4), now_ + 50ms);
  exchange_.End(Outcome::partial);
  earlier_.NoteSilence(exchange_);
  earlier_.OnBroken(exchange_);
  EXPECT_FALSE(earlier_.FindRest(exchange_)) << "not in its own";
  exchange_.Begin(b, AskFor("?B1\r"), b.times, now_ + 1s);
  earlier_.OnBegin(exchange_, {});
  exchange_.Hear(View(whole).subspan(4), now_ + 1050ms);
  exchange_.End(Outcome::no_reply);
  EXPECT_TRUE(earlier_.FindRest(exchange_));
  EXPECT_EQ(earlier_.Take()->finding.symptom, Symptom::split);
  EXPECT_FALSE(earlier_.FindRest(exchange_)) << "told once";
}

}  // namespace
}  // namespace baudgate
