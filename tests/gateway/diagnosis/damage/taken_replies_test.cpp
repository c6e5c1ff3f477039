// The latest replies that were taken tell copies, and what is missing in a damaged text.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/bytes.h"
#include "gateway/diagnosis/damage/reply_habits.h"

namespace baudgate {
namespace {

TEST(TakenReplies, TellACopyForAnotherRequest) {
  TakenReplies taken;
  taken.Add(ToBytes("?A1\r"), ToBytes("A=5\r"));
  EXPECT_TRUE(taken.WasForOther(ToBytes("?A2\r"), ToBytes("A=5\r")));
  EXPECT_FALSE(taken.WasForOther(ToBytes("?A1\r"), ToBytes("A=5\r"))) << "it is its own";
  EXPECT_FALSE(taken.WasForOther(ToBytes("?A2\r"), ToBytes("A=6\r")));
  for (int i = 0; i < 8; ++i) taken.Add(ToBytes("?B1\r"), ToBytes("B=1\r"));
  EXPECT_FALSE(taken.WasForOther(ToBytes("?A2\r"), ToBytes("A=5\r"))) << "forgotten";
}

TEST(TakenReplies, TellThatATextLacksCharacters) {
  TakenReplies taken;
  taken.Add(ToBytes("#01\r"), ToBytes(">+12.50A1\r"));
  const auto lacks = [&](std::string_view text, std::string_view request = "#01\r") {
    return taken.IsShorterThanLast(ToBytes(request), ToBytes(text));
  };
  EXPECT_TRUE(lacks(">+1.51A2\r"));
  EXPECT_TRUE(lacks(">+151A2\r"));
  EXPECT_FALSE(lacks(">+12.51A2\r")) << "a character is another one";
  EXPECT_FALSE(lacks(">+A2\r")) << "it breaks off";
  EXPECT_FALSE(lacks("+12.51A2\r")) << "its beginning is missing";
  EXPECT_FALSE(lacks(">+1.51A2\r", "#02\r")) << "nothing is known of that request";
  EXPECT_FALSE(lacks(""));
}

}  // namespace
}  // namespace baudgate
