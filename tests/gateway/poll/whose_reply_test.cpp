// To which request a reply is taken to belong, one reply after the other. Requests named "?A…" are
// polls of device a, "N…" asks for its name.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/poll/whose_reply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/gateway/poll/part_fixture.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class WhoseReplyTest : public ::testing::Test, protected ToyMembers {
 protected:
  Asked Of(const Member& member, const Request& request) const {
    return {.member = &member, .request = &request, .probe = request.steady};
  }
  /// Sends it; nothing comes.
  void Silence(const Member& member, const Request& request) {
    const Asked asked = Of(member, request);
    order_.OnSent(asked);
    order_.OnEnd(asked, Outcome::no_reply, true);
  }
  /// Sends it; this comes.
  WhoseReply::Verdict Reply(const Member& member, const Request& request, std::string_view frame) {
    const Asked asked = Of(member, request);
    order_.OnSent(asked);
    const auto verdict = order_.OnReply(asked, ToBytes(frame), Outcome::ok);
    order_.OnEnd(asked, verdict.elsewhere ? Outcome::unexpected : Outcome::ok, true);
    return verdict;
  }
  bool NeedsProbe(const Member& member, const Request& request) const {
    return order_.NeedsProbeFirst(Of(member, request));
  }
  static Request Identification(std::string_view bytes) {
    Request request = AskFor(bytes);
    request.steady = true;
    return request;
  }

  WhoseReply order_{roster};
  const Request name_ = Identification("NA\r");
  const Request one_ = AskFor("?A1\r");
  const Request two_ = AskFor("?A2\r");
};

TEST_F(WhoseReplyTest, ADeviceThatNobodyHasHeardIsProbedFirst) {
  EXPECT_TRUE(NeedsProbe(a, one_));
  EXPECT_FALSE(Reply(a, name_, "=A").elsewhere);
  EXPECT_FALSE(NeedsProbe(a, one_));
}

TEST_F(WhoseReplyTest, AfterSilenceAnotherRequestNeedsAProbeTheSameDoesNot) {
  Reply(a, name_, "=A");
  Silence(a, one_);
  EXPECT_TRUE(NeedsProbe(a, two_));
  EXPECT_FALSE(NeedsProbe(a, one_)) << "a late reply would be its own as well";
  EXPECT_FALSE(Reply(a, name_, "=A").elsewhere);
  EXPECT_FALSE(NeedsProbe(a, two_));
}

TEST_F(WhoseReplyTest, AReplyInPlaceOfTheNameBelongsToAnEarlierRequest) {
  Reply(a, name_, "=A");
  Silence(a, one_);
  EXPECT_TRUE(Reply(a, name_, "!A1").elsewhere);
  EXPECT_TRUE(NeedsProbe(a, one_));
  EXPECT_TRUE(Reply(a, one_, "=A").elsewhere) << "the name, one request late";
}

TEST_F(WhoseReplyTest, NamedNeighboursAreNotInDoubt) {
  const Request of_b = AskFor("?B1\r");
  Reply(a, name_, "=A");
  Reply(b, Identification("NB\r"), "=B");
  Silence(a, one_);
  EXPECT_FALSE(NeedsProbe(b, of_b));
}

TEST_F(WhoseReplyTest, NamelessOnesAre) {
  const Request of_b = AskFor("?B1\r", false);
  Reply(a, name_, "=A");
  Reply(b, Identification("NB\r"), "=B");
  Silence(a, one_);
  EXPECT_TRUE(NeedsProbe(b, of_b));
}

TEST_F(WhoseReplyTest, EntriesOfOneNameAreOneDevice) {
  Reply(a, name_, "=A");
  Reply(b, Identification("NA\r"), "=A");
  order_.Recognise(a, ToBytes("A"));
  order_.Recognise(b, ToBytes("A"));
  Silence(a, one_);
  EXPECT_TRUE(NeedsProbe(b, two_));
}

TEST_F(WhoseReplyTest, ASecondReplyPutsTheLastReadingsInDoubt) {
  Reply(a, name_, "=A");
  order_.OnStored({0, 0});
  order_.OnStored({0, 1});
  order_.OnStored({0, 0});
  EXPECT_THAT(order_.OnSecondReply(a), ElementsAre(QueryRef{0, 0}, QueryRef{0, 1}));
  EXPECT_THAT(order_.OnSecondReply(a), IsEmpty()) << "told once";
  EXPECT_TRUE(NeedsProbe(a, two_));
}

TEST_F(WhoseReplyTest, WhatWasReadBeforeTheLineRestedIsNotInDoubt) {
  order_.OnStored({0, 0});
  order_.OnRested();
  order_.OnStored({0, 1});
  EXPECT_THAT(order_.OnSecondReply(a), ElementsAre(QueryRef{0, 1}));
}

TEST_F(WhoseReplyTest, OnlyTheLastEightAre) {
  for (std::size_t query = 0; query < 10; ++query) order_.OnStored({0, query});
  const auto doubted = order_.OnSecondReply(a);
  ASSERT_EQ(doubted.size(), 8U);
  EXPECT_EQ(doubted.front().query, 2U);
}

TEST_F(WhoseReplyTest, APortThatClosesUnderARequestMayOweItsReply) {
  Reply(a, name_, "=A");
  order_.OnSent(Of(a, one_));
  order_.OnClosed(a);
  EXPECT_TRUE(NeedsProbe(a, two_));
}

}  // namespace
}  // namespace baudgate
