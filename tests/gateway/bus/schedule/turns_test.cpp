// Who goes first on a line, one situation after the other.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/schedule/turns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace baudgate {
namespace {

using Choice = Turns::Choice;
using ::testing::ElementsAre;

/// What goes when everything of `has` always has something to send.
std::vector<Choice> Play(Turns& turns, const Turns::Waiting& waiting,
                         const std::vector<Choice>& has, std::size_t count) {
  std::vector<Choice> taken;
  while (taken.size() < count) {
    bool any = false;
    for (const Choice choice : turns.Order(waiting)) {
      if (std::ranges::find(has, choice) == has.end()) continue;
      turns.OnTaken(choice, waiting);
      turns.OnSent(choice == Choice::urgent);
      taken.push_back(choice);
      any = true;
      break;
    }
    if (!any) break;
  }
  return taken;
}

TEST(Turns, AfterFourWritesInARowAPollHasItsTurn) {
  Turns turns;
  const auto taken = Play(turns, {}, {Choice::urgent, Choice::poll}, 6);
  EXPECT_THAT(taken, ElementsAre(Choice::urgent, Choice::urgent, Choice::urgent, Choice::urgent,
                                 Choice::poll, Choice::urgent));
}

TEST(Turns, AfterSixteenShortWritesOfRoutesToo) {
  Turns turns;
  const auto taken = Play(turns, {.short_write = true, .routed = true},
                          {Choice::urgent, Choice::routed_normal}, 18);
  EXPECT_EQ(std::ranges::count(taken, Choice::urgent), 17);
  EXPECT_EQ(taken[16], Choice::routed_normal);
}

TEST(Turns, WritesAloneGoOn) {
  Turns turns;
  EXPECT_EQ(Play(turns, {}, {Choice::urgent}, 9).size(), 9U);
}

TEST(Turns, TheCountBeginsAnewWhenNothingWaits) {
  Turns turns;
  Play(turns, {}, {Choice::urgent}, 4);
  EXPECT_FALSE(turns.UrgentAllowed(false));
  EXPECT_TRUE(turns.UrgentAllowed(true));
  turns.OnNothing();
  EXPECT_TRUE(turns.UrgentAllowed(false));
}

TEST(Turns, PollsAndRoutedRequestsAlternate) {
  Turns turns;
  const auto taken =
      Play(turns, {.routed = true}, {Choice::poll, Choice::routed_normal, Choice::routed_low}, 4);
  EXPECT_THAT(
      taken, ElementsAre(Choice::routed_normal, Choice::poll, Choice::routed_normal, Choice::poll));
}

TEST(Turns, AfterOneForEachClientOfHighPriorityComesOneOfTheRest) {
  Turns turns;
  const auto taken = Play(turns, {.routed = true, .high_clients = 2},
                          {Choice::poll, Choice::routed_high, Choice::routed_normal}, 6);
  EXPECT_THAT(taken, ElementsAre(Choice::routed_high, Choice::routed_high, Choice::routed_normal,
                                 Choice::routed_high, Choice::routed_high, Choice::poll));
}

TEST(Turns, LowPriorityComesLast) {
  Turns turns;
  EXPECT_EQ(turns.Order({.routed = true}).back(), Choice::routed_low);
}

struct Spell {
  Duration passed;
  bool failing;
  bool healthy_first;
};

TEST(Turns, FailingDevicesGiveBackWhatTheyTook) {
  Turns turns;
  const Spell spells[] = {
      {1s, false, false},  // an idle line owes nobody
      {3s, true, true},   {2s, false, true},  {1s, false, false},
      {1h, true, true},   {59s, false, true}, {1s, false, false},  // one minute at most
  };
  for (const Spell& spell : spells) {
    turns.OnTime(spell.passed, spell.failing);
    EXPECT_EQ(turns.HealthyFirst(), spell.healthy_first) << FormatDuration(spell.passed);
  }
  turns.Charge(500ms);
  EXPECT_TRUE(turns.HealthyFirst()) << "the first failure counts, too";
}

}  // namespace
}  // namespace baudgate
