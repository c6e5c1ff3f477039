// Which probe is due, shown as a row of steps: "own" or the number of a read, '!' where it is
// answered.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "protocols/common/identification.h"

namespace baudgate {
namespace {

using Own = ProbeChoice::Own;

struct Probed {
  bool knows_own = false;
  bool knows_reads = false;
};

/// What is asked in so many steps.
std::string ProbesOf(ProbeChoice& choice, const Probed& device, int steps, std::size_t reads = 3) {
  std::string text;
  for (int i = 0; i < steps; ++i) {
    const auto read = choice.Next(reads);
    const bool answered = read ? device.knows_reads : device.knows_own;
    text += (text.empty() ? "" : " ") + (read ? std::to_string(*read) : "own");
    if (answered) {
      text += "!";
      choice.OnAnswered(!read);
    } else {
      choice.OnFailed(!read);
    }
  }
  return text;
}

TEST(ProbeChoice, WhatIsAskedInTurn) {
  struct Case {
    Own own;
    Probed device;
    const char* asked;
  };
  for (const Case& c : std::vector<Case>{
           {Own::identification, {true, true}, "own! own! own! own! own! own! own! own!"},
           {Own::identification, {false, true}, "own 1! own 1! own 1! 0! 0!"},
           {Own::identification, {false, false}, "own 1 own 2 own 0 own 1"},
           {Own::none, {false, true}, "0! 0! 0! 0! 0! 0! 0! 0!"},
           {Own::none, {false, false}, "0 1 0 2 0 0 0 1"},
           {Own::read, {true, true}, "own! own! own! own! own! own! own! own!"},
           {Own::read, {false, true}, "own 1! own 1! own 1! 0! 0!"}}) {
    ProbeChoice choice(c.own);
    EXPECT_EQ(ProbesOf(choice, c.device, 8), c.asked);
  }
}

TEST(ProbeChoice, WithoutReadsOnlyTheOwnOneIsThere) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {}, 4, 0), "own own own own");
}

TEST(ProbeChoice, ADeviceThatIsOnlyAwayIsNotTakenForOneThatDoesNotKnowIt) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {false, false}, 20, 1),
            "own 0 own 0 own 0 own 0 own 0 own 0 own 0 own 0 own 0 own 0");
}

TEST(ProbeChoice, OneThatHasAnsweredItsOwnIsNotGivenUp) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {false, true}, 4), "own 1! own 1!");
  EXPECT_EQ(ProbesOf(choice, {true, true}, 1), "own!");
  EXPECT_EQ(ProbesOf(choice, {false, true}, 4), "own 1! own 2!");
}

TEST(ProbeChoice, AfterAReconnectItGetsOneMoreTry) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {false, true}, 7), "own 1! own 1! own 1! 0!");
  choice.OnReconnect();
  EXPECT_EQ(ProbesOf(choice, {false, true}, 3), "own 1! 0!");
}

TEST(ProbeChoice, AnAnsweredReadOfItsOwnIsNeverReplaced) {
  ProbeChoice choice(Own::read);
  EXPECT_EQ(ProbesOf(choice, {true, true}, 1), "own!");
  EXPECT_EQ(ProbesOf(choice, {false, true}, 4), "own own own own");
}

TEST(ProbeChoice, AnAnsweredPollBeginsAnew) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {}, 1), "own");
  choice.OnPolled();
  EXPECT_EQ(ProbesOf(choice, {}, 1), "own");
}

TEST(ProbeChoice, PrefersTheReadThatItIsTold) {
  ProbeChoice choice(Own::none);
  EXPECT_EQ(choice.Next(3, 2), 2U);
}

}  // namespace
}  // namespace baudgate
