// To which request a reply is taken to belong, one reply after the other. Requests named "?A…" are
// polls of device a, "PA…" asks for its name. Replies "!=1*XX" are untagged: they answer any "U…".
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
    return {
        .member = &member, .request = &request, .first = !request.steady, .probe = request.steady};
  }
  void Send(const Asked& asked) { order_.OnSent(asked, kStart + ++sent_ * 1s); }
  /// Sends it; nothing comes.
  void Silence(const Member& member, const Request& request) {
    const Asked asked = Of(member, request);
    Send(asked);
    order_.OnEnd(asked, Outcome::no_reply, true, kStart + sent_ * 1s);
  }
  /// Sends it; this comes.
  WhoseReply::Verdict Reply(const Member& member, const Request& request, std::string_view body,
                            Outcome outcome = Outcome::ok) {
    const Asked asked = Of(member, request);
    Send(asked);
    const auto verdict = order_.OnReply(asked, ToyReply(body), outcome);
    order_.OnEnd(asked, verdict.elsewhere ? Outcome::unexpected : outcome, true,
                 kStart + sent_ * 1s);
    return verdict;
  }
  Asked ProbeWithARead(int times) {
    const Asked probe{.member = &a, .request = &one_, .probe = true};
    for (int i = 0; i < times; ++i) {
      Send(probe);
      order_.OnReply(probe, ToyReply("=1"), Outcome::ok);
      order_.OnEnd(probe, Outcome::ok, true, kStart + sent_ * 1s);
    }
    return probe;
  }
  bool NeedsProbe(const Member& member, const Request& request) const {
    return order_.NeedsProbeFirst(Of(member, request), kStart + sent_ * 1s);
  }
  static Request Identification(std::string_view bytes) {
    Request request = AskFor(bytes);
    request.steady = true;
    return request;
  }
  static constexpr Instant kStart = Instant() + 1h;

  WhoseReply order_{roster};
  int sent_ = 0;
  const Request name_ = Identification("PA0\r");
  const Request one_ = AskFor("UA1\r");
  const Request two_ = AskFor("UA2\r");
};

TEST_F(WhoseReplyTest, ADeviceThatNobodyHasHeardIsProbedFirst) {
  EXPECT_TRUE(NeedsProbe(a, one_));
  EXPECT_FALSE(Reply(a, name_, "A0").elsewhere);
  EXPECT_FALSE(NeedsProbe(a, one_));
}

TEST_F(WhoseReplyTest, AfterSilenceAProbeGoesFirst) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  EXPECT_TRUE(NeedsProbe(a, two_));
  EXPECT_TRUE(NeedsProbe(a, one_)) << "a late reply would be an older value of its own";
  EXPECT_FALSE(Reply(a, name_, "A0").elsewhere);
  EXPECT_FALSE(NeedsProbe(a, two_));
  EXPECT_TRUE(order_.IsInStep(a));
}

TEST_F(WhoseReplyTest, AReplyInPlaceOfTheNameBelongsToAnEarlierRequest) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  EXPECT_TRUE(Reply(a, name_, "=1", Outcome::unexpected).elsewhere);
  EXPECT_TRUE(NeedsProbe(a, one_));
  EXPECT_TRUE(Reply(a, one_, "A0", Outcome::unexpected).elsewhere) << "the name, one request late";
}

TEST_F(WhoseReplyTest, AReplyToARepeatedRequestMayBeThatToTheFirst) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  const auto verdict = Reply(a, one_, "=1");
  EXPECT_TRUE(verdict.proven) << "it is the right one, perhaps an old one";
  EXPECT_EQ(verdict.older, 1s);
  EXPECT_FALSE(Reply(a, two_, "=1").proven) << "this may be that to the repetition";
}

/// Its replies come one request late, as it is known: it is asked often enough in a row. One more
/// is owed when somebody else has answered in its place.
TEST_F(WhoseReplyTest, WhoIsKnownToLagIsProbedWhenMoreIsOwed) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  Reply(a, name_, "=1", Outcome::unexpected);
  Reply(a, name_, "A0");
  EXPECT_TRUE(order_.Lags(a));
  EXPECT_FALSE(NeedsProbe(a, one_));
  EXPECT_TRUE(Reply(a, one_, "A0", Outcome::unexpected).elsewhere);
  EXPECT_TRUE(Reply(a, one_, "=1").proven);
  EXPECT_FALSE(NeedsProbe(a, one_)) << "one is owed, as it was";
  Send(Of(a, one_));
  EXPECT_TRUE(NeedsProbe(a, one_));
}

/// "B0" comes in place of a reply of a: that of a is owed as before, and no more than that.
TEST_F(WhoseReplyTest, WhatBelongsToAnotherChangesNothingOfItsOwn) {
  Reply(b, Identification("PB0\r"), "B0");
  Reply(a, name_, "A0");
  Reply(b, Identification("PB0\r"), "A0", Outcome::unexpected);
  EXPECT_TRUE(Reply(a, AskFor("UA1\r", false), "B0", Outcome::unexpected).elsewhere);
  EXPECT_EQ(order_.Owed(Of(a, AskFor("UA1\r"))), 1);
}

TEST_F(WhoseReplyTest, AReplyOfAnotherFormProvesTheOrderToo) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  const auto verdict = Reply(a, AskFor("?A1\r"), "A1=5");
  EXPECT_TRUE(verdict.proven);
  EXPECT_EQ(verdict.older, 0s);
  EXPECT_TRUE(order_.IsInStep(a));
}

TEST_F(WhoseReplyTest, AnotherNameIsAnotherDevice) {
  Reply(a, name_, "A0");
  Reply(a, one_, "=1");
  const auto verdict = Reply(a, name_, "A0=2");
  EXPECT_TRUE(verdict.replaced);
  EXPECT_FALSE(verdict.elsewhere);
  EXPECT_FALSE(NeedsProbe(a, one_));
  EXPECT_FALSE(Reply(a, name_, "A0=2").replaced) << "told once";
}

TEST_F(WhoseReplyTest, ARefusedNameIsNobodyElse) {
  Reply(a, name_, "A0");
  EXPECT_FALSE(Reply(a, name_, "A0~refused", Outcome::refused).replaced);
  EXPECT_FALSE(NeedsProbe(a, one_));
}

TEST_F(WhoseReplyTest, WhereTheNameIsRefusedTheRefusalIsTheProof) {
  Reply(a, name_, "A0~refused", Outcome::refused);
  EXPECT_FALSE(NeedsProbe(a, one_));
  Silence(a, one_);
  Reply(a, name_, "A0~refused", Outcome::refused);
  EXPECT_FALSE(NeedsProbe(a, two_));
}

TEST_F(WhoseReplyTest, WhereNoProbeIsAProofTheRequestIsAskedOftenEnough) {
  ProbeWithARead(8);
  EXPECT_TRUE(order_.IsUnprovable(a));
  Silence(a, one_);
  ProbeWithARead(1);
  EXPECT_FALSE(NeedsProbe(a, two_));
  EXPECT_FALSE(Reply(a, two_, "=2").proven);
  EXPECT_TRUE(Reply(a, two_, "=2").proven) << "one reply was owed";
}

TEST_F(WhoseReplyTest, WhoHasANameProvesNothingByOtherAnswers) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  ProbeWithARead(1);
  EXPECT_TRUE(NeedsProbe(a, one_));
}

TEST_F(WhoseReplyTest, WhoDoesNotTellHisNameAnyMoreIsAnother) {
  Reply(a, name_, "A0");
  ProbeWithARead(7);
  EXPECT_TRUE(order_.HasName(a));
  ProbeWithARead(1);
  EXPECT_FALSE(order_.HasName(a));
}

TEST_F(WhoseReplyTest, AProofHoldsForAMinute) {
  Reply(a, name_, "A0");
  Reply(a, one_, "=1");
  EXPECT_FALSE(order_.NeedsProbeFirst(Of(a, two_), kStart + 60s));
  EXPECT_TRUE(order_.NeedsProbeFirst(Of(a, two_), kStart + 62s));
}

TEST_F(WhoseReplyTest, WhoIsTrustedIsInStepAfterASilence) {
  Reply(a, name_, "A0");
  Silence(a, one_);
  order_.OnTrusted(a);
  EXPECT_TRUE(Reply(a, two_, "=2").proven);
}

TEST_F(WhoseReplyTest, NamedNeighboursAreNotInDoubt) {
  const Request of_b = AskFor("?B1\r");
  Reply(a, name_, "A0");
  Reply(b, Identification("PB0\r"), "B0");
  Silence(a, one_);
  EXPECT_FALSE(NeedsProbe(b, of_b));
}

TEST_F(WhoseReplyTest, NamelessOnesAre) {
  const Request of_b = AskFor("UB1\r", false);
  Reply(a, name_, "A0");
  Reply(b, Identification("PB0\r"), "B0");
  Silence(a, one_);
  EXPECT_TRUE(NeedsProbe(b, of_b));
}

TEST_F(WhoseReplyTest, EntriesOfOneNameAreOneDevice) {
  Reply(a, name_, "A0");
  Reply(b, Identification("PA0\r"), "A0");
  order_.Recognise(a, ToBytes("A"));
  order_.Recognise(b, ToBytes("A"));
  Silence(a, one_);
  EXPECT_TRUE(NeedsProbe(b, two_));
}

TEST_F(WhoseReplyTest, ASecondReplyPutsTheLastReadingsInDoubt) {
  Reply(a, name_, "A0");
  Reply(a, one_, "=1");
  order_.OnStored({0, 0});
  order_.OnStored({0, 1});
  order_.OnStored({0, 0});
  order_.OnSecondReply(a);
  EXPECT_THAT(order_.TakeUnproven(), ElementsAre(QueryRef{0, 0}, QueryRef{0, 1}));
  EXPECT_THAT(order_.TakeUnproven(), IsEmpty()) << "told once";
  EXPECT_TRUE(NeedsProbe(a, two_));
}

TEST_F(WhoseReplyTest, AReplyThatIsNotItsOwnThoughNothingWasOwedShowsAShift) {
  Reply(a, name_, "A0");
  Reply(a, one_, "=1");
  EXPECT_TRUE(Reply(a, AskFor("?A3\r"), "=1", Outcome::unexpected).shifted);
  EXPECT_FALSE(Reply(a, AskFor("?A3\r"), "=1", Outcome::unexpected).shifted) << "known by now";
}

TEST_F(WhoseReplyTest, WhatWasReadBeforeTheLineRestedIsNotInDoubt) {
  order_.OnStored({0, 0});
  order_.OnRested();
  order_.OnStored({0, 1});
  EXPECT_THAT(order_.TakeUnproven(), ElementsAre(QueryRef{0, 1}));
}

/// PA0 is asked until none of three replies that strangers left can be among what came.
TEST_F(WhoseReplyTest, WhatIsOwedToStrangersIsWaitedForWithProofs) {
  order_.OnOpened(a, kStart);
  for (int asked = 0; asked < 3; ++asked) {
    Reply(a, name_, "A0");
    EXPECT_FALSE(order_.IsOfLatest(Of(a, name_))) << asked;
  }
  Reply(a, name_, "A0");
  EXPECT_TRUE(order_.IsOfLatest(Of(a, name_)));
  EXPECT_TRUE(order_.IsInStep(a)) << "a refusal of the first poll is its own";
}

TEST_F(WhoseReplyTest, AReplyToAStrangerIsNotLearnedAsTheName) {
  order_.OnOpened(a, kStart);
  Reply(a, name_, "A0=17");
  Reply(a, name_, "A0");
  Reply(a, name_, "A0");
  Reply(a, name_, "A0");
  EXPECT_TRUE(order_.HasName(a));
  EXPECT_FALSE(Reply(a, name_, "A0").replaced);
}

/// What is owed to strangers can be any reply, and nothing tells these from its own.
TEST_F(WhoseReplyTest, WhoHasNoProofIsBelievedFromItsFirstReplyOn) {
  order_.OnOpened(a, kStart);
  ProbeWithARead(1);
  EXPECT_TRUE(Reply(a, one_, "=1").proven);
}

/// A text in place of a number may be another request's, unless nothing else is owed.
TEST_F(WhoseReplyTest, AnOddFormIsBelievedOnlyOfWhoWasReadInStep) {
  Reply(a, name_, "A0");
  Send(Of(a, one_));
  EXPECT_FALSE(order_.MayBeOdd(Of(a, one_))) << "it was never read";
  Reply(a, name_, "A0");
  Reply(a, one_, "=1");
  Send(Of(a, one_));
  EXPECT_TRUE(order_.MayBeOdd(Of(a, one_)));
  Send(Of(a, one_));
  EXPECT_FALSE(order_.MayBeOdd(Of(a, one_))) << "one reply is owed";
}

TEST_F(WhoseReplyTest, AfterAReconnectItIsAskedWhoItIs) {
  Reply(a, name_, "A0");
  Reply(a, one_, "=1");
  order_.OnReconnect(a);
  EXPECT_TRUE(NeedsProbe(a, two_));
  Reply(a, name_, "A0");
  EXPECT_FALSE(NeedsProbe(a, two_));
}

}  // namespace
}  // namespace baudgate
