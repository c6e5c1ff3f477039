// Bytes that come while a request goes out.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/exchange/line.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

TEST(Transmission, KeepsEarlyBytesOnlyWhereCharactersTakeTheirTime) {
  Transmission sent;
  sent.OnOpened(false);
  sent.Begin(kStart, 4ms);
  EXPECT_EQ(sent.until() - sent.from(), 4ms);
  EXPECT_FALSE(sent.Keeps(ToBytes("ab")));
  EXPECT_FALSE(sent.has_early());
  sent.OnOpened(true);
  EXPECT_TRUE(sent.Keeps(ToBytes("ab")));
  EXPECT_TRUE(sent.Keeps(ToBytes("c")));
  EXPECT_EQ(sent.TakeEarly(), ToBytes("abc"));
  EXPECT_FALSE(sent.has_early());
  sent.OnEarlyReply();
  EXPECT_FALSE(sent.Keeps(ToBytes("d"))) << "the port only claimed it";
}

TEST(Transmission, ForgetsTheEarlyBytesOfTheRequestBefore) {
  Transmission sent;
  sent.OnOpened(true);
  sent.Begin(kStart, 4ms);
  sent.Keeps(ToBytes("late"));
  sent.Begin(kStart + 1s, 4ms);
  EXPECT_FALSE(sent.has_early());
}

TEST(Transmission, MemoryIsBounded) {
  Transmission sent;
  sent.OnOpened(true);
  sent.Begin(kStart, 1h);
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(sent.Keeps(Bytes(100, 'U')));
  EXPECT_LE(sent.TakeEarly().size(), Transmission::kMostKept + 100);
}

}  // namespace
}  // namespace baudgate
