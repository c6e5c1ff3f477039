// Which orders count for a request: that of its device, and that of the line if replies carry no
// address.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/replies/whose_reply.h"
#include "tests/gateway/bus/poller/part_fixture.h"

namespace baudgate {
namespace {

class ReplyOrdersTest : public ::testing::Test, protected ToyMembers {
 protected:
  static Asked Of(const Member& member, const Request& request) {
    return {.member = &member, .request = &request};
  }
  void Send(const Member& member, const Request& request) {
    orders_.OnSent(member, {member.place, request.bytes, kStart + ++sent_ * 1s, false});
  }
  void Answer(const Member& member, const Request& request) {
    orders_.OnAnswer(member, true, [&](const SentRequest& sent, std::size_t) {
      return sent.bytes == request.bytes;
    });
  }

  ReplyOrders orders_{roster};
  int sent_ = 0;
};

TEST_F(ReplyOrdersTest, ALostReplyOfANeighbourCountsWhereRepliesNameNobody) {
  for (const bool named : {true, false}) {
    SCOPED_TRACE(named);
    orders_.Reset(a);
    orders_.Reset(b);
    const Request lost = AskFor("?B1\r", named);
    const Request asked = AskFor("?A1\r", named);
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

/// Behind a server that lags, the replies to a device may have come while its neighbour was asked.
/// They are counted as owed for ever, so how many are owed says nothing of the neighbour.
TEST_F(ReplyOrdersTest, ANeighbourMayOweWhereTheDeviceItselfOwesMore) {
  const Request theirs = AskFor("?B1\r");
  const Request asked = AskFor("?A1\r");
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

}  // namespace
}  // namespace baudgate
