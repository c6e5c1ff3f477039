// Tests of `DeviceTracker`: what follows when a device appears, disappears, or is replaced.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/device_tracker.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

class DeviceTrackerTest : public ::testing::Test, protected ToyMembers, protected PollerListener {
 protected:
  void OnDeviceState(std::uint32_t, DeviceState, DeviceState to, const std::string&, Now) override {
    state_ = to;
  }
  void OnWarning(std::uint32_t, const std::string&) override {}

  void Open() {
    accounts_.OnTime({kStart, WallTime(1'790'000'000s)}, false, nullptr);
    tracker_.OnOpened(kStart);
  }
  void Fail(Duration at) { tracker_.OnTask(a, Outcome::no_reply, "silence", kStart + at); }
  void Answer(Duration at) { tracker_.OnTask(a, Outcome::ok, {}, kStart + at); }
  void GoOffline() {
    Answer(0s);
    Fail(1s);
    Fail(2s);
    Fail(3s);
  }
  /// Ends an exchange of device a that has taken 100 ms. `change` sets what differs from a poll.
  void End(
      Outcome outcome, Duration at,
      const std::function<void(EndedExchange&)>& change = [](EndedExchange&) {}) {
    const protocols::Request request = AskFor("?A1\r");
    const Instant began = kStart + at - 100ms;
    EndedExchange ended{.member = &a,
                        .asked = {.member = &a, .request = &request, .sent = began},
                        .began = began,
                        .polls = true};
    ended.end.outcome = outcome;
    change(ended);
    tracker_.OnExchange(ended, kStart + at);
  }
  void Read(Device& device) {
    Sample sample;
    sample.point = 0;
    sample.value = 1.0;
    sample.quality = Quality::good;
    store_.Update(device.index, {&sample, 1}, {kStart, WallTime(1'790'000'000s)}, 20ms);
  }
  Quality QualityOf(const Device& device) const {
    Quality quality{};
    store_.Read(device.index,
                [&](const DeviceRecord& record) { quality = QualityAt(record, 0, kStart); });
    return quality;
  }
  std::string Due(Duration at) {
    std::string due;
    while (const auto pick = schedule_.Next(kStart + at)) due += pick->device == 0 ? 'a' : 'b';
    return due;
  }

  config::Config config_ = ToyConfig();
  PointStore store_{config_};
  OwedReplies owed_{roster};
  Agenda agenda_{roster, owed_.late_replies};
  Schedule& schedule_ = agenda_.schedule;
  Accounts accounts_{roster, schedule_, store_, 0, *this};
  DeviceTracker tracker_{roster, store_, owed_, agenda_, accounts_};
  DeviceState state_ = DeviceState::never_seen;
};

TEST_F(DeviceTrackerTest, NothingIsPolledBeforeThePortOpens) {
  EXPECT_EQ(Due(0s), "");
  Open();
  EXPECT_EQ(Due(0s), "aba") << "two queries of a, one of b";
}

TEST_F(DeviceTrackerTest, ADeviceOutOfUseIsNotPolledAfterThePortOpens) {
  tracker_.SetInUse(a, false, false, kStart);
  Open();
  EXPECT_EQ(Due(0s), "b");
}

/// The port closed before device a replied. The late reply can arrive until the ceiling, the
/// timeout of a whole exchange.
TEST_F(DeviceTrackerTest, AfterThePortOpensOnlyTheDeviceWithALateReplyWaits) {
  owed_.late_replies.OnClosed(a, kStart - 100ms);
  Open();
  EXPECT_EQ(Due(0s), "b");
  EXPECT_EQ(Due(900ms).substr(0, 1), "a") << "the ceiling is 1 s";
}

TEST_F(DeviceTrackerTest, AnOfflineDeviceIsNotPolledAndItsValuesAreNotGood) {
  Open();
  Read(a);
  Read(b);
  ASSERT_EQ(QualityOf(a), Quality::good);
  GoOffline();
  EXPECT_EQ(state_, DeviceState::offline);
  EXPECT_EQ(Due(3s), "b");
  EXPECT_NE(QualityOf(a), Quality::good) << "it may be another one when it is back";
  EXPECT_EQ(QualityOf(b), Quality::good);
}

TEST_F(DeviceTrackerTest, AReturningDeviceIsPolledAtOnce) {
  Open();
  GoOffline();
  Due(3s);
  Answer(3100ms);
  EXPECT_EQ(state_, DeviceState::online);
  EXPECT_EQ(Due(3100ms), "aa");
}

TEST_F(DeviceTrackerTest, ADeviceTakenIntoUseIsPolledAndItsOldValuesAreNotGood) {
  Open();
  Read(a);
  Due(0s);
  tracker_.SetInUse(a, false, true, kStart);
  EXPECT_EQ(Due(1s), "b");
  tracker_.SetInUse(a, true, true, kStart + 1s);
  EXPECT_EQ(Due(1s), "aa");
  EXPECT_NE(QualityOf(a), Quality::good);
}

TEST_F(DeviceTrackerTest, ADeviceOutOfUseIsNotPolledWhateverItsLastReply) {
  const protocols::Task poll;
  const protocols::Request request = AskFor("?A1\r");
  Open();
  a.conversation->OnFrame(poll, request, ToyReply("A1~foreign"), kStart);
  tracker_.OnHeard(a, kStart);
  Due(0s);
  tracker_.SetInUse(a, false, true, kStart);
  a.conversation->OnFrame(poll, request, ToyReply("A1=5"), kStart);
  tracker_.OnHeard(a, kStart);
  EXPECT_EQ(Due(1s), "b") << "it is the right one again";
  tracker_.OnReplaced(a, {kStart, kWall});
  EXPECT_EQ(Due(2s), "b") << "it tells another name";
}

TEST_F(DeviceTrackerTest, EntriesOfTheSameSenderWaitTogether) {
  Open();
  a.sender = b.sender = ToBytes("A");
  owed_.late_replies.OnClosed(a, kStart);
  tracker_.HoldBack(a);
  EXPECT_EQ(Due(900ms), "");
  EXPECT_NE(Due(1s), "");
}

TEST_F(DeviceTrackerTest, ADeviceFailsIfItsLastExchangeWasInVain) {
  const auto as_broadcast = [](EndedExchange& ended) { ended.broadcast = true; };
  End(Outcome::ok, 1s);
  End(Outcome::line_down, 2s);
  EXPECT_FALSE(schedule_.failing(0)) << "the port was lost, not the reply";
  End(Outcome::refused, 3s);
  EXPECT_FALSE(schedule_.failing(0)) << "one refusal";
  End(Outcome::refused, 4s);
  EXPECT_TRUE(schedule_.failing(0)) << "two in a row";
  End(Outcome::ok, 5s);
  EXPECT_FALSE(schedule_.failing(0));
  End(Outcome::no_reply, 6s);
  End(Outcome::ok, 7s, as_broadcast);
  EXPECT_TRUE(schedule_.failing(0)) << "no device answers a broadcast";
}

/// Chooser::OnTime counts the time of later failures.
TEST_F(DeviceTrackerTest, OnlyTheFirstFailureIsChargedAfterwards) {
  End(Outcome::no_reply, 1s);
  EXPECT_TRUE(agenda_.turns.HealthyFirst());
  End(Outcome::no_reply, 2s);
  agenda_.turns.OnTime(100ms, false);
  EXPECT_FALSE(agenda_.turns.HealthyFirst()) << "each exchange took 100 ms";
}

/// The reply may answer the first try, and carries no address. So the reply to the retry may be
/// mistaken for the reply to the next poll.
TEST_F(DeviceTrackerTest, PollsWaitAfterAnAnswerThatLeavesAReplyOutstanding) {
  const protocols::Request request = AskFor("UA1\r", false);
  const auto ask = [&](bool retry) {
    return [this, &request, retry](EndedExchange& ended) {
      ended.asked.request = &request;
      ended.asked.retry = retry;
      owed_.whose.OnSent(ended.asked, ended.began);
    };
  };
  Open();
  End(Outcome::no_reply, 100ms, ask(false));
  End(Outcome::ok, 200ms, ask(true));
  EXPECT_EQ(Due(200ms), "b");
  EXPECT_EQ(Due(2s).substr(0, 1), "a");
}

TEST_F(DeviceTrackerTest, AfterAnUnansweredTelegramALateReplyOfEachDeviceMayCome) {
  tracker_.OnUnansweredTelegram(kStart);
  for (const Device* device : {&a, &b}) {
    EXPECT_FALSE(owed_.late_replies.IsClear(*device, kStart + 999ms));
    EXPECT_TRUE(owed_.late_replies.IsClear(*device, kStart + 1s)) << "the ceiling";
  }
}

TEST_F(DeviceTrackerTest, AnOfflineDeviceGetsNoMoreReplyTimeForItsLateReplies) {
  Open();
  for (const Duration at : {1s, 2s}) {
    End(Outcome::no_reply, at, [](EndedExchange& ended) { ended.asked.sent -= 200ms; });
    tracker_.ApplyStray({.count = 20, .since_end = 10ms}, kStart + at + 10ms);
  }
  EXPECT_GT(owed_.late_replies.PatienceFor(a), 0ms);
  GoOffline();
  EXPECT_EQ(owed_.late_replies.PatienceFor(a), 0ms);
}

TEST_F(DeviceTrackerTest, AfterALateReplySilenceConcernsTheDeviceNotThePoint) {
  a.heard.OnValue(0, kStart);
  EXPECT_FALSE(a.heard.TellsOfDevice({1}, kStart));
  tracker_.CountLate(a, 50ms, kStart);
  EXPECT_TRUE(a.heard.TellsOfDevice({1}, kStart));
}

TEST_F(DeviceTrackerTest, ADeviceWhoseReplyWasLateNeedsNoFirstLooks) {
  const Probes::Facts facts{.now = kStart,
                            .idle_since = kStart,
                            .next_wanted = {},
                            .clients_gone = {},
                            .is_looked_for = [](const Member&) { return true; },
                            .client_waits = [](const Member&) { return false; }};
  for (const bool late : {false, true}) {
    Fail(0s);
    if (late) tracker_.CountLate(a, 50ms, kStart);
    EXPECT_EQ(agenda_.probes.OnTaken(a, facts),
              late ? Probes::Kind::look : Probes::Kind::first_look);
  }
}

TEST_F(DeviceTrackerTest, AfterASecondReplyTheLatestReadingsAreReadAgain) {
  for (const bool shifted : {false, true}) {
    Open();
    Read(a);
    owed_.readings.OnStored({0, {0}});
    owed_.readings.OnStored({1, {0}});
    b.in_use = false;
    ASSERT_EQ(QualityOf(a), Quality::good);
    End(Outcome::ok, 1s, [shifted](EndedExchange& ended) { ended.verdict.shifted = shifted; });
    if (!shifted) tracker_.OnSecondReply(kStart + 1s);
    EXPECT_EQ(QualityOf(a), Quality::uncertain);
    EXPECT_EQ(agenda_.write_queue.read_backs().size(), 1U) << "b is out of use";
  }
}

TEST_F(DeviceTrackerTest, AfterASecondReplyOneReplyMoreMayCome) {
  End(Outcome::ok, 1s);
  ASSERT_TRUE(owed_.whose.IsSettled(a));
  tracker_.OnSecondReply(kStart + 1s);
  EXPECT_FALSE(owed_.whose.IsSettled(a));
}

TEST_F(DeviceTrackerTest, FromTheSecondSecondReplyOnTheLineIsSilentAfterGoodReplies) {
  const protocols::Request request = AskFor("?A1\r");
  const auto silence = [&] {
    return owed_.late_replies.Aftermath({.member = &a, .request = &request}, kStart);
  };
  End(Outcome::ok, 1s);
  tracker_.OnSecondReply(kStart);
  EXPECT_EQ(silence(), 0ms);
  tracker_.OnSecondReply(kStart);
  EXPECT_EQ(silence(), 50ms) << "the drain";
}

/// A reply that came one request early may have looked like a refusal.
TEST_F(DeviceTrackerTest, AfterASecondReplyRefusedPointsAreAskedAgain) {
  a.conversation->OnFrame({}, AskFor("?A1\r"), ToyReply("A1~replan"), kStart);
  tracker_.GoOnWithPlan(a, kStart);
  ASSERT_EQ(a.planned_queries.size(), 1U);
  End(Outcome::ok, 1s);
  tracker_.OnSecondReply(kStart + 1s);
  EXPECT_EQ(a.planned_queries.size(), 2U);
}

TEST_F(DeviceTrackerTest, AnOfflineDeviceHasToProveAgainWhoItIs) {
  End(Outcome::ok, 0s, [](EndedExchange& ended) { ended.asked.probe = true; });
  ASSERT_EQ(owed_.whose.ProofEnds(a), kStart + 1min);
  GoOffline();
  EXPECT_EQ(owed_.whose.ProofEnds(a), Instant{});
}

TEST_F(DeviceTrackerTest, ADeviceThatAUserEnablesIsPolledAlthoughItsPollsAreHeld) {
  Open();
  Due(0s);
  schedule_.Hold(0, kStart + 1h);
  tracker_.OnEnabled(a, true, kStart + 1s);
  EXPECT_EQ(Due(1s), "baa");
}

}  // namespace
}  // namespace baudgate::bus
