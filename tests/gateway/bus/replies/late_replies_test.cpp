// Tests of `LateReplies`: how long replies are waited for, and which devices wait.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/replies/late_replies.h"

#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

class LateRepliesTest : public ::testing::Test, protected ToyMembers {
 protected:
  void Exchange(const Member& member, Duration began, Duration ended, Outcome outcome,
                bool retry = false) {
    asked_ = {.member = &member,
              .request = &request_,
              .sent = kStart + began,
              .retry = retry,
              .probe = false,
              .lone_probe = false};
    late_.OnEnded(asked_, {outcome, {}, {}, 0}, true, kStart + ended);
  }
  Duration LateUntil(const Member& member) const { return late_.LateUntil(member) - kStart; }
  Asked Next(const Member& member, bool named) {
    request_ = AskFor("?A1\r", named);
    return {.member = &member, .request = &request_};
  }

  LateReplies late_{roster};
  protocols::Request request_ = AskFor("?A1\r");
  Asked asked_;
};

TEST_F(LateRepliesTest, AfterSilenceALateReplyIsAwaitedUpToTheCeiling) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  EXPECT_EQ(LateUntil(a), 1000ms) << "its reply time is over already";
  EXPECT_TRUE(late_.IsClear(b, kStart + 200ms));
  EXPECT_EQ(late_.ClearAt(Next(b, true)), Instant{}) << "its replies carry its name";
  EXPECT_EQ(late_.ClearAt(Next(b, false)), kStart + 1s) << "anybody's may pass for them";
  EXPECT_EQ(late_.ClearAt(Next(a, true)), kStart + 1s);
}

TEST_F(LateRepliesTest, NoiseThatLengthensAnExchangeLengthensTheWait) {
  Exchange(a, 0ms, 400ms, Outcome::no_reply);
  EXPECT_EQ(LateUntil(a), 1200ms);
}

TEST_F(LateRepliesTest, AfterAReplyOfAnotherDeviceTheOwnReplyMayStillCome) {
  for (const bool named : {true, false}) {
    const Device& asked = named ? a : b;
    request_ = AskFor("?A1\r", named);
    Exchange(asked, 0ms, 200ms, Outcome::unexpected);
    EXPECT_EQ(LateUntil(asked), 1000ms);
    Exchange(asked, 300ms, 500ms, Outcome::no_reply, true);
    EXPECT_EQ(late_.Aftermath(asked_, kStart + 650ms), named ? 370ms : 670ms)
        << "where replies carry addresses, the one that came closed the first try";
  }
}

TEST_F(LateRepliesTest, ABroadcastDoesNotEndTheWaiting) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  request_.expect.reply = protocols::Expectation::Reply::none;
  Exchange(a, 300ms, 320ms, Outcome::ok);
  EXPECT_EQ(LateUntil(a), 1000ms);
}

TEST_F(LateRepliesTest, TheReplyToAnUnknownRequestIsAwaitedUntilTheCeiling) {
  late_.OnUnknownRequest(a, kStart);
  EXPECT_EQ(LateUntil(a), 1s);
}

// The port is a serial server, which delivers a late reply even if the connection was renewed.
TEST_F(LateRepliesTest, TheReplyToAnExchangeThatEndedEarlyIsAwaitedUntilTheCeiling) {
  Exchange(a, 0ms, 10ms, Outcome::no_reply);
  EXPECT_GE(LateUntil(a), 1000ms);
  EXPECT_LT(LateUntil(a), 1010ms);
}

TEST_F(LateRepliesTest, AnAnswerEndsTheWaiting) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  Exchange(a, 300ms, 320ms, Outcome::ok);
  EXPECT_TRUE(late_.IsClear(a, kStart + 320ms));
}

TEST_F(LateRepliesTest, AfterTwoSecondRepliesGoodRepliesAreFollowedByADrain) {
  Exchange(a, 0ms, 20ms, Outcome::ok);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 20ms), Duration());
  late_.OnSecondReply(a);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 30ms), Duration()) << "one may be chance";
  late_.OnSecondReply(a);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 30ms), a.times.drain);
  const auto aftermath_behind = [&](int good) {
    for (int i = 0; i < good; ++i) Exchange(a, 100ms, 120ms, Outcome::ok);
    return late_.Aftermath(asked_, kStart + 120ms);
  };
  EXPECT_NEAR(static_cast<double>(aftermath_behind(100) / 1us), 10'350, 100);
  EXPECT_GT(aftermath_behind(140), 1ms);
  EXPECT_EQ(aftermath_behind(30), Duration()) << "it is trusted again";
}

TEST_F(LateRepliesTest, ADamagedReplyLeavesNoReplyOutstanding) {
  Exchange(a, 0ms, 50ms, Outcome::corrupt);
  EXPECT_TRUE(late_.IsClear(a, kStart + 50ms));
}

TEST_F(LateRepliesTest, AnUnansweredProbeOfAnOfflineDeviceIsAwaitedOnlyIfUnnamed) {
  asked_ = {.member = &a, .request = &request_, .sent = kStart, .probe = true, .lone_probe = true};
  late_.OnEnded(asked_, {Outcome::no_reply, {}, {}, 0}, true, kStart + 200ms);
  EXPECT_TRUE(late_.IsClear(a, kStart + 200ms));
  request_ = AskFor("?A1\r", false);
  late_.OnEnded(asked_, {Outcome::no_reply, {}, {}, 0}, true, kStart + 200ms);
  EXPECT_EQ(LateUntil(a), 1s) << "where its reply could pass for another's it does";
}

TEST_F(LateRepliesTest, EntriesOfOneAddressWaitTogether) {
  a.sender = b.sender = ToBytes("A");
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  EXPECT_EQ(LateUntil(b), 1000ms);
}

TEST_F(LateRepliesTest, AReplyWithinTheTimeOfItsRequestIsInTime) {
  request_.reply = 3s;
  asked_ = {.member = &a, .request = &request_, .sent = kStart};
  for (int i = 0; i < 3; ++i) {
    late_.OnEnded(asked_, {Outcome::ok, {}, 2s, 0}, true, kStart + 2s);
  }
  EXPECT_EQ(late_.PatienceFor(a), 0ms);
  Exchange(a, 0ms, 3s, Outcome::no_reply);
  EXPECT_LT(late_.OnStray({9, 100ms}, kStart + 3100ms).lateness, 200ms);
}

/// The reply at 650 ms may answer the first try, sent at 0 ms. So the reply to the second try, sent
/// at 300 ms, may also take 650 ms.
TEST_F(LateRepliesTest, AfterARetryTheLineWaitsForAnswersToEarlierTries) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 650ms), 0ms) << "a probe says that it is in order";
  Exchange(a, 300ms, 500ms, Outcome::no_reply, true);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 650ms), 670ms) << "and a gap";
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 5s), 1s) << "the ceiling at most";
  Exchange(a, 600ms, 650ms, Outcome::ok, true);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 700ms), 0ms);
}

TEST_F(LateRepliesTest, AnUnnamedUnprovenAnswerDoesNotEndTheWaiting) {
  request_ = AskFor("UA1\r", false);
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  asked_.sent = kStart + 250ms;
  late_.OnEnded(asked_, {Outcome::ok, {}, {}, 0}, false, kStart + 300ms);
  EXPECT_GT(LateUntil(a), 1250ms) << "the ceiling behind the repetition";
  EXPECT_LT(LateUntil(a), 1260ms);
}

TEST_F(LateRepliesTest, AProvenOrNamedAnswerEndsTheWaiting) {
  for (const bool proven : {false, true}) {
    request_ = AskFor("?A1\r", !proven);
    Exchange(a, 0ms, 200ms, Outcome::no_reply);
    late_.OnEnded(asked_, {Outcome::ok, {}, {}, 0}, proven, kStart + 250ms);
    EXPECT_TRUE(late_.IsClear(a, kStart + 250ms)) << proven;
  }
}

TEST_F(LateRepliesTest, BytesAfterSilenceAreTheLateAnswer) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  LateReplies::StrayEffects effects = late_.OnStray({9, 120ms}, kStart + 320ms);
  EXPECT_TRUE(effects.counts);
  EXPECT_EQ(effects.late_member, &a);
  EXPECT_GT(effects.lateness, 110ms) << "320 ms after its request was given to the line, less 200";
  EXPECT_LT(effects.lateness, 120ms);
  EXPECT_EQ(effects.warned, &a);
  EXPECT_EQ(late_.ExtraDrain(a), 90ms) << "120 ms and a gap, less the drain";
  effects = late_.OnStray({3, 160ms}, kStart + 360ms);
  EXPECT_EQ(effects.late_member, nullptr) << "once for each exchange";
  EXPECT_EQ(effects.warned, nullptr) << "once for ever";
  EXPECT_EQ(late_.ExtraDrain(a), 130ms);
  late_.OnStray({1, 40ms}, kStart + 400ms);
  EXPECT_EQ(late_.ExtraDrain(a), 130ms) << "less is enough this time";
  late_.OnStray({1, 990ms}, kStart + 1190ms);
  EXPECT_EQ(late_.ExtraDrain(a), 950ms) << "the ceiling at most";
  late_.OnOffline(a);
  EXPECT_EQ(late_.ExtraDrain(a), 0ms) << "it is silent, not late";
}

TEST_F(LateRepliesTest, FourBytesMayBeAReplyOfUnknownLength) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  EXPECT_TRUE(late_.OnStray({1, 9ms}, kStart + 209ms).counts);
  EXPECT_EQ(late_.OnStray({2, 10ms}, kStart + 210ms).late_member, nullptr);
  EXPECT_EQ(late_.OnStray({1, 11ms}, kStart + 211ms).late_member, &a);
  Exchange(a, 2s, 2200ms, Outcome::no_reply);
  EXPECT_EQ(late_.OnStray({3, 10ms}, kStart + 2210ms).late_member, nullptr) << "counted anew";
}

TEST_F(LateRepliesTest, TwoLateRepliesLengthenTheReplyTime) {
  for (const Duration began : {0s, 10s}) {
    EXPECT_EQ(late_.PatienceFor(a), 0ms);
    Exchange(a, began, began + 200ms, Outcome::no_reply);
    late_.OnStray({9, 100ms}, kStart + began + 300ms);
  }
  EXPECT_GT(late_.PatienceFor(a), 100ms);
  asked_.lone_probe = false;
  EXPECT_EQ(late_.MoreReply(asked_), late_.PatienceFor(a));
  asked_.lone_probe = true;
  EXPECT_EQ(late_.MoreReply(asked_), 0ms);
  late_.OnOffline(a);
  EXPECT_EQ(late_.PatienceFor(a), 0ms);
}

TEST_F(LateRepliesTest, AReplyReceivedInExtendedTimeSetsThePatience) {
  asked_ = {.member = &a, .request = &request_, .sent = kStart, .retry = true};
  const Duration characters = 4 * a.times.character;
  const Duration received = 9 * a.times.character;
  const ExchangeEnd end{Outcome::ok, {}, characters + 260ms + received, 9};
  EXPECT_EQ(LateReplies::Lateness(asked_, end), 60ms);
  late_.OnEnded(asked_, end, true, kStart + 300ms);
  EXPECT_EQ(late_.PatienceFor(a), 0ms);
  asked_.retry = false;
  late_.OnEnded(asked_, end, true, kStart + 300ms);
  EXPECT_EQ(late_.PatienceFor(a), 75ms) << "a quarter more";
}

TEST_F(LateRepliesTest, ADeviceThatAnswersInTimeIsTrustedAgain) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  late_.OnStray({9, 120ms}, kStart + 320ms);
  for (int i = 1; i < 1000; ++i) Exchange(a, i * 1s, i * 1s + 20ms, Outcome::ok);
  EXPECT_EQ(late_.ExtraDrain(a), 0ms);
}

TEST_F(LateRepliesTest, BytesAfterARetryAnsweredForTheFirstTryAreALateReply) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  Exchange(a, 250ms, 300ms, Outcome::ok, true);
  const LateReplies::StrayEffects effects = late_.OnStray({9, 260ms}, kStart + 560ms);
  EXPECT_EQ(effects.late_member, &a);
  EXPECT_GT(effects.lateness, 100ms);
  EXPECT_LT(effects.lateness, 110ms)
      << "310 ms after its request was given to the line, less 200 ms";
  EXPECT_EQ(late_.ExtraDrain(a), 230ms) << "260 ms and a gap, less the drain";
}

/// The bytes at 400 ms can be a late reply to the first try. A single late reply can be chance, so
/// it does not count.
TEST_F(LateRepliesTest, TheAnswerToTheRetryIsInTime) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  Exchange(a, 250ms, 300ms, Outcome::ok, true);
  for (const Duration after : {100ms, 101ms}) {
    EXPECT_EQ(late_.OnStray({5, after}, kStart + 300ms + after).late_member, nullptr);
  }
  EXPECT_EQ(late_.PatienceFor(a), 0ms);
  Exchange(a, 2s, 2200ms, Outcome::no_reply);
  late_.OnStray({9, 50ms}, kStart + 2250ms);
  EXPECT_GT(late_.PatienceFor(a), 0ms) << "but it has been counted";
}

TEST_F(LateRepliesTest, BytesAfterTheNextRequestAreNoAnswerToARetry) {
  for (const Duration began : {0s, 10s}) {
    Exchange(a, began, began + 200ms, Outcome::no_reply);
    Exchange(a, began + 250ms, began + 300ms, Outcome::ok, true);
    Exchange(a, began + 2s, began + 2s + 20ms, Outcome::ok);
    late_.OnStray({9, 30ms}, kStart + began + 2s + 50ms);
  }
  EXPECT_EQ(late_.PatienceFor(a), 0ms);
}

TEST_F(LateRepliesTest, LatenessCountsFromTheFirstTry) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  Exchange(a, 300ms, 500ms, Outcome::no_reply, true);
  Exchange(a, 600ms, 800ms, Outcome::no_reply, true);
  EXPECT_GT(late_.OnStray({9, 400ms}, kStart + 1200ms).lateness, 990ms) << "due at 200 ms";
}

TEST_F(LateRepliesTest, LatenessCountsFromTheFirstTryThatMetSilence) {
  struct Try {
    Duration began;
    Outcome outcome;
  };
  struct Case {
    std::vector<Try> tries;
    Duration late;
  };
  const Case cases[] = {
      {{{0ms, Outcome::corrupt}, {300ms, Outcome::no_reply}}, 470ms},
      {{{0ms, Outcome::corrupt}, {300ms, Outcome::no_reply}, {600ms, Outcome::no_reply}}, 470ms},
      {{{0ms, Outcome::no_reply}, {300ms, Outcome::corrupt}, {600ms, Outcome::ok}}, 170ms},
      {{{0ms, Outcome::no_reply}, {300ms, Outcome::partial}}, 0ms},
      {{{0ms, Outcome::corrupt}, {600ms, Outcome::ok}}, 0ms},
      {{{0ms, Outcome::ok}, {600ms, Outcome::ok}}, 0ms},
  };
  Duration began = 2s;
  for (const Case& one : cases) {
    SCOPED_TRACE(std::to_string(&one - cases));
    Exchange(a, began - 2s, began - 1800ms, Outcome::no_reply);
    Duration ended{};
    for (const Try& each : one.tries) {
      ended = began + each.began + (each.outcome == Outcome::no_reply ? 200ms : 50ms);
      Exchange(a, began + each.began, ended, each.outcome, each.began > 0ms);
    }
    const Duration came = began + 980ms;
    const LateReplies::StrayEffects effects = late_.OnStray({9, came - ended}, kStart + came);
    EXPECT_EQ(effects.late_member != nullptr, one.late > 0ms);
    EXPECT_GE(effects.lateness, one.late);
    EXPECT_LT(effects.lateness, one.late + 20ms);
    began += 10s;
  }
}

TEST_F(LateRepliesTest, NoiseAfterTheRetryOfADamagedReplyIsNoLateReply) {
  for (const Duration began : {100s, 200s}) {
    Exchange(a, began, began + 20ms, Outcome::corrupt);
    Exchange(a, began + 100ms, began + 120ms, Outcome::ok, true);
    EXPECT_EQ(late_.OnStray({1, 5ms}, kStart + began + 125ms).late_member, nullptr);
  }
  EXPECT_EQ(late_.PatienceFor(a), 0ms);
}

/// After its answer to the retry, the device releases the bus, which makes noise.
TEST_F(LateRepliesTest, NoiseAfterTheRetryOfALostRequestIsNoLateReply) {
  request_.expect.shapes = {{.min_length = 9}, {.min_length = 5}};
  const auto repeat = [this](Duration began, std::size_t bytes) {
    Exchange(a, began, began + 200ms, Outcome::no_reply);
    EXPECT_EQ(late_.OnStray({1, 5ms}, kStart + began + 205ms).late_member, nullptr);
    Exchange(a, began + 300ms, began + 320ms, Outcome::ok, true);
    late_.OnStray({bytes, 5ms}, kStart + began + 325ms);
  };
  for (const Duration began : {100s, 200s, 300s}) repeat(began, 4);
  EXPECT_EQ(late_.PatienceFor(a), 0ms);
  for (const Duration began : {400s, 500s}) repeat(began, 5);
  EXPECT_GT(late_.PatienceFor(a), 0ms) << "five bytes may be a refusal";
}

TEST_F(LateRepliesTest, ALateReplyAfterTheAnswerOfAnotherDeviceIsNoCopy) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  Exchange(b, 250ms, 270ms, Outcome::ok);
  EXPECT_TRUE(late_.OnStray({9, 150ms}, kStart + 420ms).counts);
  EXPECT_EQ(late_.Aftermath(Next(b, true), kStart + 500ms), 0ms);
}

TEST_F(LateRepliesTest, BytesAfterTheProbeOfAnAbsentDeviceAreChargedToNoDevice) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  asked_ = {.member = &b,
            .request = &request_,
            .sent = kStart + 250ms,
            .probe = true,
            .lone_probe = true};
  late_.OnEnded(asked_, {Outcome::no_reply, {}, {}, 0}, true, kStart + 450ms);
  const LateReplies::StrayEffects effects = late_.OnStray({9, 30ms}, kStart + 480ms);
  EXPECT_EQ(effects.late_member, nullptr);
  EXPECT_EQ(effects.warned, nullptr);
}

TEST_F(LateRepliesTest, BytesAfterTheProbeOfAnUnansweredDeviceAreItsLateReply) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  asked_.probe = asked_.lone_probe = true;
  asked_.sent = kStart + 250ms;
  late_.OnEnded(asked_, {Outcome::no_reply, {}, {}, 0}, true, kStart + 450ms);
  EXPECT_EQ(late_.OnStray({9, 30ms}, kStart + 480ms).late_member, &a);
}

TEST_F(LateRepliesTest, BytesAfterAGoodAnswerLengthenTheSilenceAfterGoodAnswers) {
  Exchange(a, 0ms, 20ms, Outcome::ok);
  const LateReplies::StrayEffects effects = late_.OnStray({4, 30ms}, kStart + 50ms);
  EXPECT_TRUE(effects.counts);
  EXPECT_EQ(effects.late_member, nullptr);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 60ms), 50ms);
  EXPECT_EQ(late_.ExtraDrain(a), 0ms);
  late_.OnStray({4, 10ms}, kStart + 60ms);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 70ms), 50ms) << "less is enough this time";
  Exchange(a, 100ms, 300ms, Outcome::no_reply);
  late_.OnStray({4, 60ms}, kStart + 360ms);
  EXPECT_EQ(late_.ExtraDrain(a), 30ms) << "that was no copy";
}

TEST_F(LateRepliesTest, BytesLongAfterAGoodAnswerAreNoCopy) {
  const Duration longest = a.times.drain + 256 * a.times.character;
  Exchange(a, 0ms, 20ms, Outcome::ok);
  late_.OnStray({4, longest + 1us}, kStart + 20ms + longest + 1us);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 1s), 0ms);
  late_.OnStray({4, longest}, kStart + 20ms + longest);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 1s), longest);
}

TEST_F(LateRepliesTest, TheSilenceAfterARetryCoversLateBytesAndCopies) {
  Exchange(a, 0ms, 20ms, Outcome::ok);
  late_.OnStray({4, 280ms}, kStart + 300ms);
  Exchange(a, 2s, 2200ms, Outcome::no_reply);
  asked_.retry = true;
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 2210ms), 300ms) << "a copy of its reply";
  late_.OnStray({9, 130ms}, kStart + 2330ms);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 2400ms), 520ms)
      << "400 ms, a gap and 100 ms that its bytes came later than its drain time";
}

TEST_F(LateRepliesTest, TheLongestReplyTimeIsThatOfTheSlowestDevice) {
  a.times.reply = 300ms;
  EXPECT_EQ(late_.LongestReply(), 300ms);
  b.times.reply = 400ms;
  EXPECT_EQ(late_.LongestReply(), 400ms);
}

TEST_F(LateRepliesTest, NoSilenceFollowsRepliesThatMatchOnlyTheirRequest) {
  for (const bool numbered : {false, true}) {
    request_.any_order = !numbered;
    request_.numbered = numbered;
    Exchange(a, 0ms, 200ms, Outcome::no_reply);
    Exchange(a, 300ms, 500ms, Outcome::no_reply, true);
    EXPECT_EQ(late_.Aftermath(asked_, kStart + 650ms), 0ms) << numbered;
    Exchange(a, 600ms, 650ms, Outcome::ok, true);
    late_.OnStray({40, 30ms}, kStart + 680ms);
    EXPECT_EQ(late_.Aftermath(asked_, kStart + 700ms), 0ms) << numbered;
  }
}

TEST_F(LateRepliesTest, AFewBytesAfterAGoodAnswerAreNoSecondReply) {
  Exchange(a, 0ms, 20ms, Outcome::ok);
  EXPECT_FALSE(late_.OnStray({1, 1ms}, kStart + 21ms).counts);
  EXPECT_TRUE(late_.OnStray({1, 1ms}, kStart + 21ms).counts) << "two are more than a driver leaves";
  late_.OnStray({1, 30ms}, kStart + 50ms);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 60ms), 0ms);
  late_.OnStray({1, 31ms}, kStart + 51ms);
  EXPECT_EQ(late_.Aftermath(asked_, kStart + 60ms), 51ms) << "four of them may be";
}

TEST_F(LateRepliesTest, BytesAfterADamagedReplyAreNotLate) {
  Exchange(a, 0ms, 20ms, Outcome::corrupt);
  const LateReplies::StrayEffects effects = late_.OnStray({4, 130ms}, kStart + 150ms);
  EXPECT_FALSE(effects.counts);
  EXPECT_EQ(effects.warned, nullptr);
  EXPECT_EQ(late_.ExtraDrain(a), 0ms);
}

TEST_F(LateRepliesTest, BytesAfterABrokenReplyAreItsRest) {
  Exchange(a, 0ms, 60ms, Outcome::partial);
  const LateReplies::StrayEffects effects = late_.OnStray({4, 130ms}, kStart + 190ms);
  EXPECT_FALSE(effects.counts);
  EXPECT_EQ(effects.late_member, nullptr);
  EXPECT_EQ(effects.warned, &a);
  EXPECT_NE(effects.warning.find("timing.gap"), std::string::npos) << effects.warning;
  EXPECT_EQ(late_.ExtraDrain(a), 100ms);
}

TEST_F(LateRepliesTest, BytesAfterTheCeilingAreNoise) {
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  const LateReplies::StrayEffects effects = late_.OnStray({4, 1001ms}, kStart + 1201ms);
  EXPECT_TRUE(effects.counts);
  EXPECT_EQ(effects.late_member, nullptr);
  EXPECT_EQ(late_.ExtraDrain(a), 0ms);
}

TEST_F(LateRepliesTest, AfterALostConnectionLateRepliesAreAwaitedUpToTheCeiling) {
  late_.OnClosed(a, kStart);
  EXPECT_EQ(LateUntil(a), 1s);
}

TEST(LateAnswersAtALocalPort, AreAwaitedForTheReplyTimeAndTheDrain) {
  const ToyMembers members("/dev/ttyS1");
  LateReplies late(members.roster);
  late.OnClosed(members.a, kStart);
  EXPECT_EQ(late.LateUntil(members.a), kStart + 250ms);
}

TEST_F(LateRepliesTest, ALateReplyDuringAnExchangeOfAnotherDeviceIsFoundOnce) {
  request_.expect = ToyProtocol().expect(request_.bytes, {});
  Exchange(a, 0ms, 200ms, Outcome::no_reply);
  late_.Hear(ToyReply("A1=5"), kStart + 400ms);
  request_ = AskFor("?B1\r");
  Exchange(b, 300ms, 420ms, Outcome::ok);
  const auto found = late_.TakeOthers();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].member, &a);
  EXPECT_EQ(found[0].lateness,
            400ms - TransmissionTime(AskFor("?A1\r"), a.times.character) - 200ms);
  late_.Hear(ToyReply("A1=5"), kStart + 450ms);
  EXPECT_TRUE(late_.TakeOthers().empty()) << "told once";
}

TEST_F(LateRepliesTest, AReplyInTimeOfAnotherAddressOrTooLateIsNoLateReply) {
  struct Row {
    const char* what;
    const char* reply;
    Duration came;
  };
  for (const Row& row : {Row{"of nobody who is awaited", "B1=5", 400ms},
                         Row{"to no request of it", "A1=5", 190ms}, Row{"noise", "A1=5", 2min}}) {
    SCOPED_TRACE(row.what);
    LateReplies late(roster);
    protocols::Request request = AskFor("?A1\r");
    request.expect = ToyProtocol().expect(request.bytes, {});
    const Asked asked{.member = &a, .request = &request, .sent = kStart};
    late.OnEnded(asked, {Outcome::no_reply, {}, {}, 0}, true, kStart + 200ms);
    const Asked other{.member = &b, .request = &request, .sent = kStart + 300ms};
    late.OnEnded(other, {Outcome::ok, {}, {}, 0}, true, kStart + 320ms);
    late.Hear(ToyReply(row.reply), kStart + row.came);
    EXPECT_TRUE(late.TakeOthers().empty());
  }
}

}  // namespace
}  // namespace baudgate::bus
