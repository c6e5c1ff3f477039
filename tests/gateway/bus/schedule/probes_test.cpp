// Tests of `Probes`, `ProbeBudget` and `Hold`: which absent device is probed next, and when.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/probes.h"

#include <gtest/gtest.h>

#include "gateway/bus/schedule/turns.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

class ProbesTest : public ::testing::Test, protected ToyMembers {
 protected:
  static void PutOffline(Member& member) { member.health.OnTask(Outcome::no_reply, kStart); }
  Probes::Facts At(Duration at) const {
    Probes::Facts facts;
    facts.now = facts.idle_since = kStart + at;
    facts.next_wanted = next_wanted_;
    facts.is_looked_for = [](const Member&) { return true; };
    facts.client_waits = [](const Member&) { return false; };
    return facts;
  }

  LateReplies late_{roster};
  Probes probes_{roster, late_};
  std::optional<Instant> next_wanted_;
};

TEST_F(ProbesTest, WithoutOfflineDevicesThereIsNoProbe) {
  EXPECT_EQ(probes_.Next(At(0s)), nullptr);
  EXPECT_FALSE(probes_.NextAt(At(0s)));
  EXPECT_EQ(probes_.NoticeBound(kStart), std::nullopt);
}

TEST_F(ProbesTest, OfflineDevicesTakeTurns) {
  PutOffline(a);
  PutOffline(b);
  EXPECT_EQ(probes_.Next(At(0s)), &a);
  probes_.OnTaken(a, At(0s));
  EXPECT_EQ(probes_.Next(At(0s)), &b);
  probes_.OnTaken(b, At(0s));
  EXPECT_EQ(probes_.Next(At(0s)), &a);
}

TEST_F(ProbesTest, ADeviceThatIsNotLookedForIsNotProbed) {
  PutOffline(a);
  PutOffline(b);
  Probes::Facts facts = At(0s);
  facts.is_looked_for = [this](const Member& member) { return &member == &b; };
  EXPECT_EQ(probes_.Next(facts), &b);
}

TEST_F(ProbesTest, AProbeWaitsWhileALateReplyMayCome) {
  PutOffline(a);
  late_.OnClosed(a, kStart);
  EXPECT_EQ(probes_.Next(At(0s)), nullptr);
  EXPECT_EQ(probes_.NextAt(At(0s)), kStart + 1s) << "the ceiling";
  EXPECT_EQ(probes_.NextAt(At(1s)), kStart + 1s);
}

TEST_F(ProbesTest, ADeviceThatCannotBeProbedIsTriedAgainAfterAMinute) {
  PutOffline(a);
  PutOffline(b);
  probes_.OnAsked(a, false, kStart);
  EXPECT_EQ(probes_.Next(At(0s)), &b);
  b.health.OnTask(Outcome::ok, kStart);
  EXPECT_EQ(probes_.Next(At(0s)), nullptr);
  EXPECT_EQ(probes_.NextAt(At(0s)), kStart + 1min);
  EXPECT_EQ(probes_.NoticeBound(kStart), std::nullopt) << "no probe notices its return";
  EXPECT_EQ(probes_.Next(At(1min)), &a);
  probes_.OnOffline(a, kStart);
  EXPECT_EQ(probes_.Next(At(0s)), &a) << "it was forgotten why";
  EXPECT_TRUE(probes_.CannotProbe(a));
  probes_.OnAsked(a, true, kStart);
  EXPECT_FALSE(probes_.CannotProbe(a));
}

TEST_F(ProbesTest, TheNextProbeWaitsUntilItsShareIsEarned) {
  PutOffline(a);
  next_wanted_ = kStart;
  ASSERT_EQ(probes_.NextAt(At(0s)), kStart) << "nothing is owed yet";
  probes_.NoteEnd(a, Probes::Kind::look, kStart);
  EXPECT_EQ(probes_.began(), kStart);
  probes_.OnIdle(200ms, kStart + 200ms);
  EXPECT_FALSE(probes_.began());
  EXPECT_FALSE(probes_.NextAt(At(9s))) << "2 % of ten seconds";
  EXPECT_EQ(probes_.NextAt(At(10s)), kStart + 10s);
}

TEST_F(ProbesTest, ANewlyOfflineDeviceIsProbedSoonTwice) {
  PutOffline(a);
  PutOffline(b);
  probes_.OnOffline(b, kStart);
  next_wanted_ = kStart;
  Duration at = 0s;
  for (int i = 0; i < 2; ++i) {
    EXPECT_FALSE(i > 0 && probes_.NextAt(At(at - 1ms))) << "20 % of a second";
    ASSERT_EQ(probes_.NextAt(At(at)), kStart + at);
    EXPECT_EQ(probes_.Next(At(at)), &b) << "before all others";
    ASSERT_EQ(probes_.OnTaken(b, At(at)), Probes::Kind::first_look);
    probes_.NoteEnd(b, Probes::Kind::first_look, kStart + at);
    probes_.OnIdle(200ms, kStart + at + 200ms);
    at += 1s;
  }
  EXPECT_EQ(probes_.Next(At(at)), &a) << "then they take turns";
  EXPECT_EQ(probes_.OnTaken(a, At(at)), Probes::Kind::look);
}

TEST_F(ProbesTest, EveryThirdProbeWaitsForASilentLine) {
  PutOffline(a);
  const auto look = [this](Duration at, Duration idle_for) {
    Probes::Facts facts = At(at);
    facts.idle_since -= idle_for;
    const Probes::Kind kind = probes_.OnTaken(a, facts);
    probes_.NoteEnd(a, kind, kStart + at);
    probes_.OnIdle(next_wanted_ ? 200ms : 0ms, kStart + at + 200ms);
    return kind;
  };
  EXPECT_EQ(look(0s, 0s), Probes::Kind::look);
  EXPECT_EQ(look(1s, 0s), Probes::Kind::look);
  EXPECT_EQ(probes_.NextAt(At(2s)), kStart + 2300ms);
  EXPECT_EQ(look(2300ms, 300ms), Probes::Kind::look);
  EXPECT_EQ(probes_.NextAt(At(3s)), kStart + 3s) << "it had one";

  next_wanted_ = kStart;
  EXPECT_EQ(look(20s, 0s), Probes::Kind::look);
  EXPECT_EQ(look(40s, 0s), Probes::Kind::look);
  EXPECT_FALSE(probes_.NextAt(At(49s))) << "2 % of the time, as for any look";
  EXPECT_EQ(look(60s, 0s), Probes::Kind::rested_look);
  EXPECT_EQ(look(80s, 0s), Probes::Kind::look);
}

/// Writes come every 250 ms: no poll is due, but the line is never silent for long.
TEST_F(ProbesTest, AProbeDoesNotWaitForASilentLineForEver) {
  PutOffline(a);
  for (const Duration at : {0s, 1s}) {
    const Probes::Kind kind = probes_.OnTaken(a, At(at));
    probes_.NoteEnd(a, kind, kStart + at);
    probes_.OnIdle(0ms, kStart + at + 200ms);
  }
  EXPECT_EQ(probes_.NextAt(At(2s)), kStart + 2300ms);
  EXPECT_EQ(probes_.NextAt(At(3s)), kStart + 3s);
  EXPECT_EQ(probes_.OnTaken(a, At(3s)), Probes::Kind::rested_look);
}

TEST_F(ProbesTest, ANewlyOfflineDeviceTakesTurnsAfterTenSeconds) {
  PutOffline(a);
  PutOffline(b);
  probes_.OnOffline(b, kStart);
  EXPECT_EQ(probes_.Next(At(9s)), &b);
  EXPECT_EQ(probes_.Next(At(10s)), &a);
}

TEST_F(ProbesTest, ShortWritesHaveTheirOwnShare) {
  PutOffline(a);
  next_wanted_ = kStart;
  probes_.NoteEnd(a, Probes::Kind::look, kStart);
  probes_.OnIdle(200ms, kStart + 200ms);
  EXPECT_EQ(probes_.NextWriteAt(a, At(1s)), kStart + 1s);
  probes_.NoteEnd(a, Probes::Kind::short_write, kStart + 1s);
  probes_.OnIdle(200ms, kStart + 1200ms);
  EXPECT_EQ(probes_.NextWriteAt(a, At(2s)), kStart + 3s) << "10 % of two seconds";
}

TEST_F(ProbesTest, AProbeForAWaitingClientGoesWhenTheShareIsEarned) {
  PutOffline(a);
  next_wanted_ = kStart;
  probes_.NoteEnd(a, Probes::Kind::look, kStart);
  probes_.OnIdle(200ms, kStart + 200ms);
  Probes::Facts facts = At(2s);
  facts.client_waits = [](const Member&) { return true; };
  EXPECT_EQ(probes_.NextAt(facts), kStart + 10s);
}

TEST_F(ProbesTest, OpeningThePortResetsTheProbeShare) {
  PutOffline(a);
  next_wanted_ = kStart;
  probes_.NoteEnd(a, Probes::Kind::look, kStart);
  probes_.OnIdle(200ms, kStart + 200ms);
  probes_.OnOpened();
  EXPECT_EQ(probes_.NextAt(At(1s)), kStart + 1s);
}

TEST_F(ProbesTest, TheNoticeBoundCoversATurnOfAllAndTheLongestPeriod) {
  PutOffline(a);
  const auto one = probes_.NoticeBound(kStart);
  EXPECT_GT(one, 1s) << "b's period";
  PutOffline(b);
  EXPECT_GT(probes_.NoticeBound(kStart), one);
}

TEST(ProbeBudget, IdleLineProbesAfterThePause) {
  ProbeBudget budget;
  EXPECT_EQ(budget.NextProbe(kStart, std::nullopt, kStart, 600ms), kStart);
  budget.OnProbe(kStart, kStart + 600ms, 0ms);
  EXPECT_EQ(budget.NextProbe(kStart + 600ms, std::nullopt, kStart + 600ms, 600ms),
            kStart + 600ms + ProbeBudget::kPause);
}

TEST(ProbeBudget, AProbeInALongIdleTimeIsFree) {
  ProbeBudget budget;
  budget.OnProbe(kStart, kStart + 600ms, 600ms);
  const Instant later = kStart + 2s;
  EXPECT_EQ(budget.NextProbe(later, later + 600ms, kStart, 600ms), later);
  EXPECT_EQ(budget.NextProbe(later, later + 599ms, later, 600ms), std::nullopt)
      << "it would delay a poll, and the share is not earned yet";
}

TEST(ProbeBudget, ADelayingProbeIsSentWhenOthersWaitLeast) {
  ProbeBudget budget;
  const Instant due = kStart + 500ms;
  EXPECT_EQ(budget.NextProbe(kStart, due, kStart, 600ms), kStart) << "they wait 100 ms";
  EXPECT_EQ(budget.NextProbe(kStart + 200ms, due, kStart, 600ms), std::nullopt);
  EXPECT_EQ(budget.NextProbe(due, due, kStart, 600ms), std::nullopt) << "it is their turn";
}

TEST(ProbeBudget, OnlyTheWaitOfOthersIsCharged) {
  ProbeBudget budget;
  budget.OnProbe(kStart, kStart + 600ms, 100ms);
  const Instant earned = kStart + 5s;  // the probe's cost of 100 ms, divided by 2 %
  EXPECT_EQ(budget.NextProbe(earned - 1ms, earned, earned - 1ms, 600ms), std::nullopt);
  EXPECT_EQ(budget.NextProbe(earned, earned, earned, 600ms), earned);
}

TEST(ProbeBudget, ContendedProbesTakeTheCappedShareAtMost) {
  ProbeBudget budget;
  Duration spent{};
  for (Instant now = kStart; now < kStart + 1h;) {
    const bool probe = budget.NextProbe(now, now, now, 600ms) == now;
    const Duration took = probe ? 600ms : 20ms;
    if (probe) budget.OnProbe(now, now + took, took);
    if (probe) spent += took;
    now += took;
  }
  const double share =
      static_cast<double>(spent.count()) / static_cast<double>(Duration(1h).count());
  EXPECT_LE(share, ProbeBudget::kShare * 1.02);
  EXPECT_GE(share, ProbeBudget::kShare * 0.9) << "a dead device would never be found again";
}

TEST(ProbeBudget, TheIntervalFollowsFromThePauseOrTheShare) {
  EXPECT_EQ(ProbeBudget::Interval(600ms, 0ms), 850ms);
  EXPECT_EQ(ProbeBudget::Interval(600ms, 600ms), 30s);
}

TEST(HoldTest, APauseWaitsFourSecondsForLateReplies) {
  Hold hold;
  EXPECT_FALSE(hold.WaitsUntil());
  hold.Pause(kStart);
  hold.Pause(kStart + 1s);
  EXPECT_EQ(hold.WaitsUntil(), kStart + 4s);
}

struct HoldRow {
  const char* what;
  void (*begin)(Hold&);
  void (*then)(Hold&);
  bool holds;
};

TEST(HoldTest, EndsOnlyOnTheEventsOfTheTable) {
  const auto wind_up = [](Hold& hold) { hold.WindUp(); };
  const auto pause = [](Hold& hold) { hold.Pause(kStart); };
  const auto both = [](Hold& hold) {
    hold.Pause(kStart);
    hold.WindUp();
  };
  const auto go_on = [](Hold& hold) { EXPECT_TRUE(hold.GoOn()); };
  const auto close = [](Hold& hold) { hold.OnClosed(); };
  const auto call_off = [](Hold& hold) { hold.CallOffWindUp(); };
  const auto open = [](Hold& hold) { hold.OnOpened(); };
  const HoldRow kRows[] = {
      {"a pause goes on", pause, go_on, false},
      {"a pause, and the port closes", pause, close, false},
      {"a wind-up, and the port closes", wind_up, close, true},
      {"a wind-up, and the port opens again", wind_up, open, false},
      {"a wind-up that is called off", wind_up, call_off, false},
      {"a pause that goes on while the line winds up", both, go_on, true},
      {"both, and the port opens", both, open, false},
  };
  for (const HoldRow& row : kRows) {
    SCOPED_TRACE(row.what);
    Hold hold;
    row.begin(hold);
    EXPECT_TRUE(hold.holds());
    row.then(hold);
    EXPECT_EQ(hold.holds(), row.holds);
    EXPECT_FALSE(hold.GoOn()) << "there is no pause";
  }
}

}  // namespace
}  // namespace baudgate::bus
