// When an end of the connection is no outage, and for how long it is remembered.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/rest.h"

#include <gtest/gtest.h>

#include "tests/support/times.h"

namespace baudgate {
namespace {

const Bytes kRequest = {1, 2, 3};

TEST(Rest, AConnectionForEachRequestIsGivenUpAgain) {
  Rest rest(false);
  rest.OnOpened(0);
  EXPECT_FALSE(rest.Holds(kRequest, kStart));
  rest.OnBytes(kStart);
  EXPECT_FALSE(rest.Holds(kRequest, kStart));
  EXPECT_TRUE(rest.OnEnded(1, false)) << "in place of the second answer";
  int alone = 0;
  while (rest.Holds(kRequest, kStart)) {
    ++alone;
    EXPECT_TRUE(rest.OnOpened(1));
    EXPECT_EQ(rest.TakeHeld(), kRequest);
    ASSERT_LE(alone, 1000);
  }
  EXPECT_GT(alone, 900);
}

TEST(Rest, FourConnectionsInVainAreNoOutageWhereOthersAreAskedNext) {
  for (const bool several : {false, true}) {
    Rest rest(false);
    int rested = 0;
    for (;;) {
      rest.OnOpened(0);
      rest.Holds(kRequest, kStart);
      if (!rest.OnEnded(0, several)) break;
      ++rested;
    }
    EXPECT_EQ(rested, several ? 4 : 0);
  }
}

TEST(Rest, TheEndOfAConnectionThatIsAlwaysWantedIsAnOutage) {
  Rest rest(true);
  rest.OnOpened(0);
  rest.OnBytes(kStart);
  EXPECT_FALSE(rest.OnEnded(1, true));
  EXPECT_FALSE(rest.rests());
}

TEST(Rest, AnEndInUseIsADrop) {
  const struct {
    std::uint64_t answers;
    bool asks;
    Duration since;
    bool drops;
  } rows[] = {
      {1, false, 2ms, false},   // behind each answer
      {8, false, 300ms, true},  // between two requests
      {8, false, 20s, false},   // after a rest
      {1, true, 2ms, false},    // a request had met the end behind an answer
      {8, true, 2ms, true},    {0, true, 300ms, false},  // it never answers
  };
  for (const auto& row : rows) {
    Rest rest(false);
    rest.OnOpened(100);
    rest.Holds(kRequest, kStart);
    if (!row.asks) rest.OnBytes(kStart);
    EXPECT_EQ(rest.IsDrop(100 + row.answers, kStart + row.since), row.drops) << row.answers;
  }
}

}  // namespace
}  // namespace baudgate
