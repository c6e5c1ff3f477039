// The lagging server by itself: what arrives of replies 1, 2, 3 … and when.
// SPDX-License-Identifier: Apache-2.0
#include "tests/protocols/runs/lagging_server.h"

#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class Queue {
 public:
  explicit Queue(unsigned seed = 1) : server({{}, false, 5ms}, seed) {}

  /// What arrives after request `number`, a second behind the one before: "2+5 3+5" are replies 2
  /// and 3 after 5 ms each.
  std::string Ask(int number, bool answered = true) {
    const Instant at = kStart + number * 1s;
    Bytes reply;
    if (answered) reply = ToBytes(std::to_string(number));
    std::string text;
    for (const TimedPiece& piece : server.OnRequest(ToBytes("?"), std::move(reply), at)) {
      if (!text.empty()) text += ' ';
      text += std::string(AsText(piece.bytes)) + "+" + std::to_string(piece.after / 1ms);
    }
    return text;
  }

  LaggingServer server;
};

TEST(LaggingServer, WithoutFaultsHandsOnWhatItIsGiven) {
  Queue queue;
  EXPECT_EQ(queue.Ask(1), "1+5");
  EXPECT_EQ(queue.Ask(2, false), "");
  EXPECT_EQ(queue.Ask(3), "3+5");
}

TEST(LaggingServer, AnswersSoManyBehindForEver) {
  Queue queue;
  queue.server.faults.behind = 2;
  EXPECT_EQ(queue.Ask(1), "");
  EXPECT_EQ(queue.Ask(2), "");
  EXPECT_EQ(queue.Ask(3), "1+5");
  EXPECT_EQ(queue.Ask(4, false), "") << "nothing comes in, nothing goes out";
  EXPECT_EQ(queue.Ask(5), "2+5");
}

TEST(LaggingServer, WhatItOwesComesAtOnceOrNotAtAllWhenItIsWellAgain) {
  bool at_once = false;
  bool lost = false;
  for (unsigned seed = 1; seed < 20; ++seed) {
    Queue queue(seed);
    queue.server.faults.behind = 1;
    queue.Ask(1);
    queue.server.faults.behind = 0;
    const std::string comes = queue.Ask(2);
    at_once = at_once || comes == "1+5 2+5";
    lost = lost || comes == "2+5";
    EXPECT_TRUE(comes == "1+5 2+5" || comes == "2+5") << comes;
  }
  EXPECT_TRUE(at_once && lost);
}

TEST(LaggingServer, ADelayedReplyHoldsUpThoseBehindIt) {
  Queue queue;
  queue.server.faults = {.delay = 1, .longest_delay = 5s, .growing = true};
  EXPECT_EQ(queue.Ask(1), "1+1005");
  EXPECT_EQ(queue.Ask(2), "2+1505");
  queue.server.faults = {};
  EXPECT_EQ(queue.Ask(3), "3+505") << "not before reply 2";
  EXPECT_EQ(queue.Ask(4), "4+5");
}

TEST(LaggingServer, ACopyComesAtOnceOrInPlaceOfTheNextAnswer) {
  Queue queue;
  queue.server.faults.copy = 1;
  EXPECT_EQ(queue.Ask(1), "1+5 1+5");
  queue.server.faults.copy_comes = ServerFaults::Copy::in_place;
  EXPECT_EQ(queue.Ask(2), "2+5");
  EXPECT_EQ(queue.Ask(3), "2+5 3+5");
}

TEST(LaggingServer, OneReplyMayOvertakeAnotherAndIsThrownAwayInTime) {
  Queue queue;
  queue.server.faults = {.overtake = 1, .aside = 1h};
  EXPECT_EQ(queue.Ask(1), "");
  queue.server.faults.overtake = 0;
  std::string comes;
  for (int number = 2; number < 20; ++number) comes += queue.Ask(number) + " ";
  EXPECT_NE(comes.find("1+5"), std::string::npos) << comes;
  queue.server.faults = {.overtake = 1, .aside = 1500ms};
  EXPECT_EQ(queue.Ask(30), "");
  queue.server.faults.overtake = 0;
  comes.clear();
  for (int number = 40; number < 60; ++number) comes += queue.Ask(number) + " ";
  EXPECT_EQ(comes.find("30+"), std::string::npos) << comes;
}

TEST(LaggingServer, LosesCutsAndDamages) {
  Queue queue;
  queue.server.faults.drop = 1;
  EXPECT_EQ(queue.Ask(1), "");
  queue.server.faults = {.cut = 1};
  const std::string cut = queue.Ask(1234567);
  EXPECT_EQ(cut.find("1"), 0U) << cut;
  EXPECT_LT(cut.size(), std::string("1234567+5").size()) << cut;
  queue.server.faults = {.damage = 1};
  int damaged = 0;
  for (int number = 1111111; number < 1111121; ++number) {
    damaged += queue.Ask(number) != std::to_string(number) + "+5" ? 1 : 0;
  }
  EXPECT_GE(damaged, 9) << "a bit may be flipped twice";
  EXPECT_EQ(queue.server.counts().spoilt, 11U);
  EXPECT_TRUE(queue.server.arrivals().back().spoilt);
}

TEST(LaggingServer, DoesTheSameForTheSameSeed) {
  const auto run = [](unsigned seed) {
    Queue queue(seed);
    queue.server.faults = {.drop = 5, .delay = 3, .hold = 7, .overtake = 6, .copy = 4};
    std::string all;
    for (int number = 1; number < 200; ++number) all += queue.Ask(number) + "\n";
    return all;
  };
  EXPECT_EQ(run(3), run(3));
  EXPECT_NE(run(3), run(4));
}

}  // namespace
}  // namespace baudgate
