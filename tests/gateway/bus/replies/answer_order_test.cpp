// Tests of `AnswerOrder`, `ReplyOrders` and `Patience`. A request is a letter. The reply to 'P'
// proves its order, because it differs from the replies to all other letters, which are equal.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <deque>

#include "gateway/bus/replies/late_replies.h"
#include "gateway/bus/replies/whose_reply.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

class Order {
 public:
  void Send(char request) {
    order.OnSent({0, {static_cast<std::uint8_t>(request)}, kStart + ++sent_ * 1s, request == 'P'});
    latest_ = request;
  }
  void Reply(char to) {
    known =
        order.OnAnswer((to == 'P') == (latest_ == 'P'), [to](const SentRequest& sent, std::size_t) {
          return sent.place != SentRequest::kNobody && (to == 'P') == sent.proof;
        });
  }
  void Answered(char request) {
    Send(request);
    Reply(request);
  }
  bool IsOnly(char request) const { return order.IsAnswerTo({static_cast<std::uint8_t>(request)}); }

  AnswerOrder order;
  bool known = false;

 private:
  int sent_ = 0;
  char latest_ = 0;
};

TEST(AnswerOrderTest, TheOrderIsSafeWhileEveryRequestIsAnswered) {
  Order order;
  EXPECT_TRUE(order.order.IsSafe());
  order.Answered('a');
  EXPECT_TRUE(order.order.IsSafe());
  EXPECT_EQ(order.order.Older(), 0s);
}

TEST(AnswerOrderTest, AfterSilenceTheOrderIsNotSafeUntilAProofIsAnswered) {
  Order order;
  order.Send('a');
  EXPECT_FALSE(order.order.IsSafe());
  order.Answered('a');
  EXPECT_FALSE(order.order.IsSafe()) << "that was the reply to the first, perhaps";
  order.Answered('P');
  EXPECT_TRUE(order.order.IsInStep()) << "a lag would have answered the proof otherwise";
}

/// The request "READ" has another meaning behind "channel 1" than behind "channel 2".
TEST(AnswerOrderTest, EqualRequestsOfDifferentContextsAreDifferentRequests) {
  AnswerOrder order;
  const Bytes read = {'R'};
  const auto send = [&](std::uint8_t channel) {
    order.OnSent({0, read, kStart, false, {channel}});
  };
  const auto answer = [&] {
    order.OnAnswer(true, [](const SentRequest& sent, std::size_t) { return sent.place == 0; });
  };
  send(1);
  send(2);
  answer();
  EXPECT_FALSE(order.IsAnswerTo(read)) << "perhaps that of channel 1, which came late";
  EXPECT_FALSE(order.IsOfLatest());
  send(2);
  answer();
  EXPECT_TRUE(order.IsAnswerTo(read));
}

TEST(AnswerOrderTest, AReplyIsAsOldAsTheOldestRequestItMayAnswer) {
  Order order;
  order.Answered('b');
  order.Send('a');
  order.Send('a');
  order.Answered('a');
  EXPECT_TRUE(order.IsOnly('a'));
  EXPECT_EQ(order.order.Older(), 2s);
  order.Answered('b');
  EXPECT_FALSE(order.IsOnly('b')) << "it may be that to a";
}

TEST(AnswerOrderTest, AReplyToAnotherRequestShowsALag) {
  Order order;
  order.Send('a');
  order.Answered('a');
  order.Send('P');
  order.Reply('a');
  EXPECT_FALSE(order.order.MayBeInStep());
  order.Answered('P');
  EXPECT_TRUE(order.order.MayBeInStep());
}

TEST(AnswerOrderTest, AnyRequestIsSafeAfterProofsAlone) {
  Order order;
  for (int i = 0; i < 100; ++i) order.Send('P');
  order.Answered('P');
  EXPECT_TRUE(order.order.IsSafe());
  order.Answered('a');
  EXPECT_TRUE(order.order.IsInStep()) << "no lag answers the first read behind so many proofs";
}

TEST(AnswerOrderTest, AnUnmatchedReplyChangesNothingUntilTheOrderIsLost) {
  Order order;
  order.Answered('a');
  order.Send('a');
  order.Reply('P');
  EXPECT_FALSE(order.known);
  EXPECT_EQ(order.order.Owed(), 1U) << "that to a is owed as before";
  order.order.OnLost();
  EXPECT_EQ(order.order.Owed(), AnswerOrder::kMostOwed);
  order.Answered('b');
  EXPECT_FALSE(order.IsOnly('b')) << "any a may be answered now";
  order.Answered('P');
  EXPECT_TRUE(order.order.IsInStep());
}

/// The device answers each request one request late. If it were three requests late, the same
/// replies would come.
TEST(AnswerOrderTest, MoreProofsResolveAnAmbiguousLag) {
  Order order;
  for (int i = 0; i < 3; ++i) {
    order.Send('P');
    order.Send('a');
  }
  for (int i = 0; i < 2; ++i) {
    order.Send('P');
    order.Reply('a');
    order.Send('a');
    order.Reply('P');
  }
  order.Send('P');
  order.Reply('a');
  order.Answered('P');
  EXPECT_FALSE(order.order.IsOfLatest()) << "it may be that to an earlier P";
  for (int i = 0; i < 3; ++i) order.Answered('P');
  EXPECT_TRUE(order.order.IsOfLatest());
}

TEST(AnswerOrderTest, ARequestRepeatedPastAllOutstandingRepliesHasItsAnswer) {
  Order order;
  order.Send('b');
  order.Send('b');
  order.Answered('a');
  EXPECT_FALSE(order.IsOnly('a'));
  order.Answered('a');
  EXPECT_FALSE(order.IsOnly('a'));
  order.Answered('a');
  EXPECT_TRUE(order.IsOnly('a')) << "the third is that to the first a at the least";
  EXPECT_EQ(order.order.Older(), 2s);
}

TEST(AnswerOrderTest, UnansweredRequestsDoNotShiftTheOrder) {
  Order order;
  order.Send('a');
  for (int i = 0; i < 3; ++i) order.Send('P');
  order.Send('b');
  order.Reply('a');
  EXPECT_FALSE(order.IsOnly('b'));
  order.Send('b');
  order.Reply('b');
  EXPECT_TRUE(order.IsOnly('b'));
  EXPECT_EQ(order.order.Older(), 1s);
}

TEST(AnswerOrderTest, ACopyMayTakeThePlaceOfTheNextReply) {
  Order order;
  order.Answered('b');
  order.Answered('a');
  order.order.OnCopy();
  EXPECT_FALSE(order.order.IsSafe());
}

TEST(AnswerOrderTest, NoLagPassesUnnoticed) {
  for (std::size_t lag = 0; lag < 12; ++lag) {
    Order order;
    std::deque<char> owed;
    int accepted = 0;
    for (int i = 0; i < 2000; ++i) {
      const char sent = !order.order.IsSafe() ? 'P' : i / 3 % 2 == 0 ? 'a' : 'b';
      order.Send(sent);
      owed.push_back(sent);
      if (owed.size() <= lag) continue;
      const char answer = owed.front();
      owed.pop_front();
      order.Reply(answer);
      if (answer == 'P' || sent == 'P' || !order.order.MayBeInStep()) continue;
      if (!order.IsOnly(sent)) continue;
      ++accepted;
      ASSERT_EQ(answer, sent) << "lag " << lag << ", request " << i;
    }
    if (lag == 0) {
      EXPECT_EQ(accepted, 2000);
    }
  }
}

TEST(AnswerOrderTest, ADeviceBeyondTheOutstandingLimitIsNotInStepAfterAReply) {
  Order order;
  for (std::size_t request = 0; request < 2 * AnswerOrder::kMostOwed; ++request) order.Send('a');
  EXPECT_EQ(order.order.Owed(), AnswerOrder::kMostOwed);
  order.Answered('b');
  EXPECT_FALSE(order.IsOnly('b'));
}

TEST(AnswerOrderTest, ThreeRepliesToStrangersAreAssumedOutstanding) {
  Order order;
  order.order.OnStranger(kStart);
  for (int reply = 0; reply < 3; ++reply) {
    order.Answered('P');
    EXPECT_FALSE(order.IsOnly('P')) << reply;
  }
  order.Answered('P');
  EXPECT_TRUE(order.IsOnly('P'));
  order.Answered('a');
  EXPECT_TRUE(order.order.IsInStep());
}

TEST(AnswerOrderTest, AnyNumberOfStrangersHasThreeOutstandingReplies) {
  Order order;
  for (int opening = 0; opening < 30; ++opening) order.order.OnStranger(kStart);
  EXPECT_EQ(order.order.Owed(), 3U);
  for (int reply = 0; reply < 4; ++reply) order.Answered('P');
  EXPECT_TRUE(order.IsOnly('P'));
}

TEST(AnswerOrderTest, ForgettingStrangersLeavesOnlyOwnRequests) {
  Order order;
  order.Send('a');
  order.order.OnStranger(kStart);
  order.Send('b');
  order.order.ForgetStrangers();
  EXPECT_EQ(order.order.Owed(), 2U) << "those to a and b";
  Order other;
  other.order.OnStranger(kStart);
  other.order.ForgetStrangers();
  EXPECT_TRUE(other.order.IsInStep());
}

class ReplyOrdersTest : public ::testing::Test, protected ToyMembers {
 protected:
  static Asked Of(const Member& member, const protocols::Request& request) {
    return {.member = &member, .request = &request};
  }
  void Send(const Member& member, const protocols::Request& request) {
    orders_.OnSent(member, {member.place, request.bytes, kStart + ++sent_ * 1s, false});
  }
  void Answer(const Member& member, const protocols::Request& request) {
    orders_.OnAnswer(member, true, [&](const SentRequest& sent, std::size_t) {
      return sent.bytes == request.bytes;
    });
  }

  ReplyOrders orders_{roster};
  int sent_ = 0;
};

TEST_F(ReplyOrdersTest, ALostReplyOfANeighbourCountsWhenRepliesAreUnnamed) {
  for (const bool named : {true, false}) {
    SCOPED_TRACE(named);
    orders_.Reset(a);
    orders_.Reset(b);
    const protocols::Request lost = AskFor("?B1\r", named);
    const protocols::Request asked = AskFor("?A1\r", named);
    Send(b, lost);
    Send(a, asked);
    EXPECT_EQ(orders_.Owed(Of(a, asked)), named ? 1 : 2);
    EXPECT_TRUE(orders_.OthersOwe(Of(a, asked)));
    Answer(a, asked);
    EXPECT_TRUE(orders_.MayBeInStep(Of(a, asked)));
    EXPECT_TRUE(orders_.IsAnswerTo(Of(a, asked)));
    EXPECT_EQ(orders_.Owed(Of(a, asked)), 0);
  }
}

TEST_F(ReplyOrdersTest, DeviceAndLineOrderMustAgreeForUnnamedReplies) {
  for (const bool named : {true, false}) {
    for (const Device* lost : {&a, &b}) {
      SCOPED_TRACE(testing::Message() << (named ? "named, " : "nameless, ") << lost->config->name);
      orders_.Reset(a);
      orders_.Reset(b);
      protocols::Request asked = AskFor("?A1\r");
      // A converter can write the address into a reply of any device, so only a number in the reply
      // counts.
      asked.numbered = !named;
      const bool doubted = lost == &a || !named;
      Send(*lost, AskFor("?A2\r", named));
      EXPECT_EQ(orders_.IsSafe(Of(a, asked)), !doubted);
      Send(a, asked);
      EXPECT_EQ(orders_.Owed(Of(a, asked)), doubted ? 2 : 1);
      orders_.OnAnswer(a, true, [](const SentRequest& sent, std::size_t) {
        return sent.place != SentRequest::kNobody;
      });
      EXPECT_EQ(orders_.IsAnswerTo(Of(a, asked)), !doubted);
      EXPECT_EQ(orders_.IsOfLatest(Of(a, asked)), !doubted);
      EXPECT_EQ(orders_.Older(Of(a, asked)), doubted ? 1s : 0s);
    }
  }
}

TEST_F(ReplyOrdersTest, EventsApplyToTheDeviceOrderAndTheLineOrder) {
  const protocols::Request named = AskFor("?A1\r");
  const protocols::Request nameless = AskFor("?A1\r", false);
  const auto owed = [&] {
    return std::pair(orders_.Owed(Of(a, named)), orders_.Owed(Of(a, nameless)));
  };
  Send(a, named);
  orders_.Reset(a);
  EXPECT_EQ(owed(), std::pair(0, 0));
  Send(a, named);
  orders_.ForgetBefore(a, kStart + sent_ * 1s);
  EXPECT_EQ(owed(), std::pair(1, 1)) << "it was sent at that time";
  orders_.ForgetBefore(a, kStart + sent_ * 1s + 1ms);
  EXPECT_EQ(owed(), std::pair(0, 0));
  orders_.OnCopy(a);
  EXPECT_EQ(owed(), std::pair(1, 1));
  EXPECT_EQ(orders_.Owed(Of(b, nameless)), 1) << "it may come in place of a reply of b";
  Send(a, named);
  for (const protocols::Request* asked : {&named, &nameless}) {
    EXPECT_FALSE(orders_.MayBeInStep(Of(a, *asked)));
  }
  orders_.OnOddForm(a);
  for (const protocols::Request* asked : {&named, &nameless}) {
    EXPECT_TRUE(orders_.MayBeInStep(Of(a, *asked)));
  }
}

TEST_F(ReplyOrdersTest, OutstandingRepliesOfANeighbourCountBesideThoseOfTheDevice) {
  const protocols::Request theirs = AskFor("?B1\r");
  const protocols::Request asked = AskFor("?A1\r");
  for (int i = 0; i < 3; ++i) Send(a, asked);
  Send(b, theirs);
  Answer(b, theirs);
  Send(a, asked);
  EXPECT_FALSE(orders_.OthersOwe(Of(a, asked)));
  Send(b, theirs);
  Send(b, theirs);
  Answer(b, theirs);
  Send(a, asked);
  EXPECT_EQ(orders_.Owed(Of(a, asked)), 5);
  EXPECT_TRUE(orders_.OthersOwe(Of(a, asked)));
}

TEST_F(ReplyOrdersTest, EntriesOfOneAddressShareAnOrder) {
  orders_.Recognise(a, ToBytes("A"));
  orders_.Recognise(b, ToBytes("A"));
  Send(a, AskFor("?A1\r"));
  EXPECT_FALSE(orders_.Of(b).IsInStep());
  orders_.Reset(b);
  EXPECT_TRUE(orders_.Of(a).IsInStep());
}

class PatienceTest : public ::testing::Test, protected ToyMembers {
 protected:
  PatienceTest() {
    a.times.reply = 300ms;
    a.times.gap = 20ms;
    a.times.ceiling = 1s;
  }
  Patience patience_;
};

TEST_F(PatienceTest, TwoLateRepliesLengthenThePatienceAndOneDoesNot) {
  patience_.OnLate(a, 150ms);
  EXPECT_EQ(patience_.More(a), 0ms);
  patience_.OnLate(a, 100ms);
  EXPECT_EQ(patience_.More(a), 187500us) << "a quarter more than the latest of them";
  EXPECT_EQ(patience_.More(b), 0ms);
}

TEST_F(PatienceTest, TwoLateRepliesFarApartDoNotLengthenThePatience) {
  patience_.OnLate(a, 300ms);
  for (int i = 0; i < 100; ++i) patience_.OnAnswered(a, -280ms);
  patience_.OnLate(a, 160ms);
  EXPECT_EQ(patience_.More(a), 0ms);
  for (int i = 0; i < 99; ++i) patience_.OnAnswered(a, -280ms);
  patience_.OnLate(a, 80ms);
  EXPECT_EQ(patience_.More(a), 200ms) << "these two are not; what was before is forgotten";
}

TEST_F(PatienceTest, ALateReplyInBetweenKeepsEarlierLateRepliesRemembered) {
  for (const bool taken : {false, true}) {
    patience_ = {};
    patience_.OnLate(a, 160ms);
    for (int i = 0; i < 60; ++i) patience_.OnAnswered(a, -280ms);
    taken ? patience_.OnAnswered(a, 40ms) : patience_.OnLate(a, 40ms);
    for (int i = 0; i < 60; ++i) patience_.OnAnswered(a, -280ms);
    patience_.OnLate(a, 240ms);
    EXPECT_EQ(patience_.More(a), 300ms) << taken;
  }
}

TEST_F(PatienceTest, AReplyInTimeDoesNotCountAsLate) {
  patience_.OnLate(a, 0ms);
  patience_.OnLate(a, 160ms);
  EXPECT_EQ(patience_.More(a), 0ms);
}

TEST_F(PatienceTest, EndsWithTheCeiling) {
  patience_.OnLate(a, 600ms);
  patience_.OnLate(a, 600ms);
  EXPECT_EQ(patience_.More(a), 680ms) << "which has room for a gap as well";
}

TEST_F(PatienceTest, IsNotLengthenedByRepliesAfterTheCeiling) {
  for (int i = 0; i < 5; ++i) patience_.OnLate(a, 681ms);
  EXPECT_EQ(patience_.More(a), 0ms) << "no wait within the ceiling would have met them";
}

TEST_F(PatienceTest, ShrinksSlowlyAndNotWhileRepliesAreLate) {
  patience_.OnLate(a, 160ms);
  patience_.OnLate(a, 160ms);
  for (int i = 0; i < 200; ++i) patience_.OnAnswered(a, -280ms);
  EXPECT_GT(patience_.More(a), 160ms);
  EXPECT_LT(patience_.More(a), 170ms);
  patience_.OnAnswered(a, 160ms);
  EXPECT_EQ(patience_.More(a), 200ms);
  patience_.OnAnswered(a, 10ms);
  EXPECT_EQ(patience_.More(a), 200ms) << "one that is less late needs no less";
  for (int i = 0; i < 5'000; ++i) patience_.OnAnswered(a, -280ms);
  EXPECT_GT(patience_.More(a), 1ms);
  for (int i = 0; i < 1'000; ++i) patience_.OnAnswered(a, -280ms);
  EXPECT_EQ(patience_.More(a), 0ms) << "less than a millisecond is nothing";
}

TEST_F(PatienceTest, IsZeroForAnOfflineDevice) {
  patience_.OnLate(a, 160ms);
  patience_.OnLate(a, 160ms);
  patience_.OnOffline(a);
  EXPECT_EQ(patience_.More(a), 0ms);
}

}  // namespace
}  // namespace baudgate::bus
