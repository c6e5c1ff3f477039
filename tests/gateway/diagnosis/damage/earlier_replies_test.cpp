// Tests of `EarlierReplies`, `SameAgain`, `TakenReplies`, `NumberedRequests` and `ReplyLag`.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/earlier_replies.h"

#include <gtest/gtest.h>

#include <optional>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/diagnosis/damage/reply_habits.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::diagnosis {
namespace {

class EarlierRepliesTest : public ::testing::Test, protected bus::ToyMembers {
 protected:
  void Exchange(const bus::Member& member, std::string_view asked,
                const std::vector<std::string_view>& came = {}, std::string_view own = {}) {
    exchange_.Begin(member, bus::AskFor(asked), member.times, now_);
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

TEST_F(EarlierRepliesTest, ALateReplyOfAnotherDeviceAmendsThatExchange) {
  Exchange(a, "?A1\r");
  Exchange(b, "?B1\r", {"A1=5", "B1=7"}, "B1=7");
  EXPECT_EQ(Attribute(Symptom::device_beside).symptom, Symptom::clean);
  const auto earlier = earlier_.Take();
  ASSERT_TRUE(earlier);
  EXPECT_EQ(earlier->member, &a);
  EXPECT_EQ(earlier->finding.symptom, Symptom::late);
  EXPECT_FALSE(earlier_.Take());
}

TEST_F(EarlierRepliesTest, EachOfTwoLateRepliesAmendsItsOwnRequest) {
  Exchange(a, "?A1\r");
  Exchange(a, "?A2\r", {"A1=5"});
  EXPECT_EQ(Attribute(Symptom::other_reply).symptom, Symptom::late);
  Exchange(b, "?B1\r", {"A2=6"});
  EXPECT_EQ(Attribute(Symptom::other_device).symptom, Symptom::late_other);
  const auto second = earlier_.Take();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->member, &a);
}

TEST_F(EarlierRepliesTest, ALateReplyInPlaceOfTheOwnReplyNamesItsDevice) {
  Exchange(a, "?A1\r");
  Exchange(b, "?B1\r", {"A1=5"});
  const Finding finding = Attribute(Symptom::other_device);
  EXPECT_EQ(finding.symptom, Symptom::late_other);
  EXPECT_EQ(finding.cause, "a");
}

TEST_F(EarlierRepliesTest, AnAcceptedReplyThatComesAgainIsACopy) {
  Exchange(a, "?A1\r", {"A1=5"}, "A1=5");
  Exchange(a, "?A2\r", {"A1=5", "A2=6"}, "A2=6");
  EXPECT_EQ(Attribute(Symptom::noise_before).symptom, Symptom::copies);
  Exchange(a, "?A1\r", {"A2=7", "A1=5"}, "A1=5");
  EXPECT_EQ(Attribute(Symptom::noise_before).symptom, Symptom::others_beside) << "it differs";
  EXPECT_FALSE(earlier_.Take());
}

TEST_F(EarlierRepliesTest, AReplyToNoRequestIsNotReattributed) {
  Exchange(a, "?A1\r", {"C1=5"});
  EXPECT_EQ(Attribute(Symptom::other_device).symptom, Symptom::other_device);
}

TEST_F(EarlierRepliesTest, ALateEchoOfAnOwnRequestIsRecognised) {
  Exchange(a, "?A1\r");
  exchange_.Begin(b, bus::AskFor("?B1\r"), b.times, now_);
  earlier_.OnBegin(exchange_, {});
  exchange_.Hear(ToBytes("?A2\r"), now_ + 50ms);
  EXPECT_FALSE(earlier_.IsLateEcho(exchange_));
  exchange_.Hear(ToBytes("?A1\r"), now_ + 60ms);
  EXPECT_TRUE(earlier_.IsLateEcho(exchange_));
}

TEST_F(EarlierRepliesTest, OneOfTwoRepliesAfterALostTryIsLate) {
  Exchange(a, "?A1\r");
  Exchange(a, "?A1\r", {"A1=5"}, "A1=5");
  Exchange(a, "?A2\r", {"A1=6", "A2=7"}, "A2=7");
  const auto late = earlier_.FindLostTry(a, now_);
  ASSERT_TRUE(late);
  EXPECT_EQ(late->symptom, Symptom::late);
  EXPECT_EQ(earlier_.Take()->back, 2U);
  EXPECT_FALSE(earlier_.FindLostTry(a, now_)) << "each is taken once";
}

TEST_F(EarlierRepliesTest, TheRestOfABrokenReplyIsFoundInALaterExchange) {
  const Bytes whole = ToyReply("A1=5");
  exchange_.Begin(a, bus::AskFor("?A1\r"), a.times, now_);
  earlier_.OnBegin(exchange_, {});
  exchange_.Hear(View(whole).first(4), now_ + 50ms);
  exchange_.End(Outcome::partial);
  earlier_.NoteSilence(exchange_);
  earlier_.OnBroken(exchange_);
  EXPECT_FALSE(earlier_.FindRest(exchange_)) << "not in its own";
  exchange_.Begin(b, bus::AskFor("?B1\r"), b.times, now_ + 1s);
  earlier_.OnBegin(exchange_, {});
  exchange_.Hear(View(whole).subspan(4), now_ + 1050ms);
  exchange_.End(Outcome::no_reply);
  EXPECT_TRUE(earlier_.FindRest(exchange_));
  EXPECT_EQ(earlier_.Take()->finding.symptom, Symptom::split);
  EXPECT_FALSE(earlier_.FindRest(exchange_)) << "told once";
}

struct Run {
  std::string_view asked;
  bool right = true;
  bool misfit = false;
  bool numbered = false;
};

bool ComesAgain(const Run& run) {
  SameAgain same;
  bool again = false;
  bool first = true;
  for (const char request : run.asked) {
    again = same.OnCame(ToBytes("1234"), ToBytes(std::string_view(&request, 1)), run.right && first,
                        run.misfit && !first, run.numbered);
    first = false;
  }
  return again;
}

TEST(SameAgain, FiveRequestsWithTheSameReplyAreDetected) {
  EXPECT_FALSE(ComesAgain({.asked = "AB"}));
  EXPECT_FALSE(ComesAgain({.asked = "ABCD"}));
  EXPECT_TRUE(ComesAgain({.asked = "ABCDE"}));
  EXPECT_TRUE(ComesAgain({.asked = "ABC", .numbered = true}));
  EXPECT_FALSE(ComesAgain({.asked = "ABCDE", .right = false})) << "it was never right";
  EXPECT_FALSE(ComesAgain({.asked = "AAAAAAA"})) << "to one request the same may come";
  EXPECT_TRUE(ComesAgain({.asked = "ABBBBBB", .misfit = true}));
}

TEST(SameAgain, ADifferentReplyRestartsTheCount) {
  SameAgain same;
  for (const char* const request : {"A", "B", "C", "D"}) {
    EXPECT_FALSE(same.OnCame(ToBytes("1234"), ToBytes(request), true, false, false));
  }
  EXPECT_FALSE(same.OnCame(ToBytes("1235"), ToBytes("E"), true, false, false));
  EXPECT_FALSE(same.OnCame(ToBytes("1234"), ToBytes("F"), true, false, false));
}

TEST(TakenReplies, RecogniseACopyOfAReplyToAnotherRequest) {
  TakenReplies taken;
  taken.Add(ToBytes("?A1\r"), ToBytes("A=5\r"));
  EXPECT_TRUE(taken.WasForOther(ToBytes("?A2\r"), ToBytes("A=5\r")));
  EXPECT_FALSE(taken.WasForOther(ToBytes("?A1\r"), ToBytes("A=5\r"))) << "it is its own";
  EXPECT_FALSE(taken.WasForOther(ToBytes("?A2\r"), ToBytes("A=6\r")));
  for (int i = 0; i < 8; ++i) taken.Add(ToBytes("?B1\r"), ToBytes("B=1\r"));
  EXPECT_FALSE(taken.WasForOther(ToBytes("?A2\r"), ToBytes("A=5\r"))) << "forgotten";
}

TEST(TakenReplies, RecogniseATextThatLacksCharacters) {
  TakenReplies taken;
  taken.Add(ToBytes("#01\r"), ToBytes(">+12.50A1\r"));
  const auto lacks = [&](std::string_view text, std::string_view request = "#01\r") {
    return taken.IsShorterThanLast(ToBytes(request), ToBytes(text));
  };
  EXPECT_TRUE(lacks(">+1.51A2\r"));
  EXPECT_TRUE(lacks(">+151A2\r"));
  EXPECT_FALSE(lacks(">+12.51A2\r")) << "a character is another one";
  EXPECT_FALSE(lacks(">+A2\r")) << "it breaks off";
  EXPECT_FALSE(lacks("+12.51A2\r")) << "its beginning is missing";
  EXPECT_FALSE(lacks(">+1.51A2\r", "#02\r")) << "nothing is known of that request";
  EXPECT_FALSE(lacks(""));
}

class NumberedRequestsTest : public ::testing::Test, protected bus::ToyMembers {
 protected:
  NumberedRequestsTest() {
    numbered_.tcp = true;
    a.protocol = &numbered_;
  }
  void Send(std::uint8_t number, Instant now, Duration reply_time = {}) {
    protocols::Request request;
    request.bytes = {0, number, 3};
    request.reply = reply_time;
    sent_.OnSent(a, request, now);
  }
  std::optional<Duration> Lateness(std::uint8_t number, Instant came) const {
    const auto late = sent_.Find(Bytes{0, number, 9, 9}, came);
    return late ? std::optional(late->after) : std::nullopt;
  }

  protocols::Protocol numbered_ = ToyProtocol();
  NumberedRequests sent_;
};

TEST_F(NumberedRequestsTest, ReturnTheTimeSinceTheFirstTry) {
  Send(1, kStart);
  EXPECT_EQ(Lateness(1, kStart + 2s), std::nullopt) << "nothing was asked since";
  Send(1, kStart + 1s);
  Send(2, kStart + 2s);
  EXPECT_EQ(Lateness(1, kStart + 3s), 3s);
  sent_.OnAnswered(Bytes{0, 1, 9});
  EXPECT_EQ(Lateness(1, kStart + 3s), 2s) << "the other try";
  EXPECT_EQ(Lateness(1, kStart + 1100ms), 1100ms) << "that one's reply would not be late";
  sent_.OnAnswered(Bytes{0, 1, 9});
  EXPECT_EQ(Lateness(1, kStart + 4s), std::nullopt) << "both tries are answered: it is no reply";
  EXPECT_EQ(Lateness(2, kStart + 3s), std::nullopt);
  EXPECT_EQ(Lateness(7, kStart + 3s), std::nullopt) << "nobody here has asked that";
  EXPECT_FALSE(sent_.Find(Bytes{0}, kStart + 3s));
}

TEST_F(NumberedRequestsTest, WithTheirOwnReplyTimeAreDueLater) {
  Send(1, kStart);
  Send(2, kStart, 2s);
  Send(3, kStart);
  EXPECT_EQ(sent_.Find(Bytes{0, 1, 9}, kStart + 1500ms)->lateness, 1300ms);
  EXPECT_EQ(sent_.Find(Bytes{0, 2, 9}, kStart + 1500ms)->lateness, -500ms);
}

TEST_F(NumberedRequestsTest, OnlyTheLatestAreRemembered) {
  for (std::uint8_t number = 0; number < 200; ++number) Send(number, kStart);
  EXPECT_EQ(Lateness(190, kStart + 1s), 1s);
  EXPECT_EQ(Lateness(100, kStart + 1s), std::nullopt);
}

TEST_F(NumberedRequestsTest, WithoutANumberAreNotFound) {
  numbered_.tcp = false;
  Send(1, kStart);
  Send(2, kStart + 1s);
  EXPECT_EQ(Lateness(1, kStart + 2s), std::nullopt);
}

struct Late {
  Duration after;
  std::optional<Duration> next = 12ms;
};

bool LagsBehind(const std::vector<Late>& replies) {
  ReplyLag lag;
  bool lags = false;
  for (const Late& reply : replies) lags = lag.OnLate(reply.after, reply.next);
  return lags;
}

TEST(ReplyLag, FourRepliesOfVaryingLatenessShowALag) {
  EXPECT_FALSE(LagsBehind({{620ms, std::nullopt}}));
  EXPECT_FALSE(LagsBehind({{900ms}, {1400ms}, {700ms}})) << "three may be chance";
  EXPECT_TRUE(LagsBehind({{900ms}, {1400ms}, {700ms}, {950ms}}));
  EXPECT_TRUE(LagsBehind({{900ms}, {900ms}, {900ms}, {1400ms}}));
  EXPECT_TRUE(LagsBehind({{900ms}, {900ms}, {900ms, 13ms}, {950ms}}));
  EXPECT_FALSE(LagsBehind({{900ms}, {910ms, 22ms}, {905ms, 17ms}, {900ms}}))
      << "it is always as late";
  EXPECT_FALSE(LagsBehind({{900ms}, {960ms, 42ms}, {905ms, 17ms}, {900ms}})) << "or nearly so";
}

TEST(ReplyLag, AnUnrequestedReplyRestartsTheCount) {
  const std::vector<Late> replies = {{900ms}, {1400ms}, {700ms}, {800ms, std::nullopt},
                                     {900ms}, {1400ms}, {700ms}};
  EXPECT_FALSE(LagsBehind(replies));
}

}  // namespace
}  // namespace baudgate::diagnosis
