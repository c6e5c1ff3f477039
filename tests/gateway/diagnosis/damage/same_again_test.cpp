// The table of same_again.h.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string_view>

#include "gateway/diagnosis/damage/reply_habits.h"

namespace baudgate {
namespace {

struct Run {
  std::string_view asked;
  bool right = true;  // the first one
  bool misfit = false;
  bool numbered = false;
};

bool ComesAgain(const Run& run) {
  SameAgain same;
  bool again = false;
  bool first = true;
  for (const char request : run.asked) {
    again = same.OnCame(ToBytes("1234"), ToBytes(std::string_view(&request, 1)), run.right && first,
                        run.misfit && !first, run.numbered);
    first = false;
  }
  return again;
}

TEST(SameAgain, Table) {
  EXPECT_FALSE(ComesAgain({.asked = "AB"}));
  EXPECT_FALSE(ComesAgain({.asked = "ABCD"}));
  EXPECT_TRUE(ComesAgain({.asked = "ABCDE"}));
  EXPECT_TRUE(ComesAgain({.asked = "ABC", .numbered = true}));
  EXPECT_FALSE(ComesAgain({.asked = "ABCDE", .right = false})) << "it was never right";
  EXPECT_FALSE(ComesAgain({.asked = "AAAAAAA"})) << "to one request the same may come";
  EXPECT_TRUE(ComesAgain({.asked = "ABBBBBB", .misfit = true}));
}

TEST(SameAgain, AnotherReplyBeginsANewCount) {
  SameAgain same;
  for (const char* const request : {"A", "B", "C", "D"}) {
    EXPECT_FALSE(same.OnCame(ToBytes("1234"), ToBytes(request), true, false, false));
  }
  EXPECT_FALSE(same.OnCame(ToBytes("1235"), ToBytes("E"), true, false, false));
  EXPECT_FALSE(same.OnCame(ToBytes("1234"), ToBytes("F"), true, false, false));
}

}  // namespace
}  // namespace baudgate
