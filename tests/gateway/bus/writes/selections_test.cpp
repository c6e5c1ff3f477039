// Who has selected what, and until when.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/writes/write_gate.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

using Taken = Selections::Verdict;

constexpr Selections::Point kTripOutput{0, 7};

TEST(Selections, AreGoodOnceAndForTheirOwner) {
  Selections selections;
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart), Taken::none);
  selections.Select(1, kTripOutput, kStart + 10s);
  EXPECT_EQ(selections.Take(2, kTripOutput, kStart + 1s), Taken::foreign);
  EXPECT_EQ(selections.Take(1, {0, 8}, kStart + 1s), Taken::none) << "another point";
  EXPECT_EQ(selections.Take(1, {1, 7}, kStart + 1s), Taken::none) << "another device";
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 2s), Taken::selected);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 3s), Taken::none) << "used up";
}

TEST(Selections, End) {
  Selections selections;
  selections.Select(1, kTripOutput, kStart + 10s);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 10s), Taken::expired);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 10s), Taken::none) << "told once";
  selections.Select(1, kTripOutput, kStart + 10s);
  selections.Select(1, kTripOutput, kStart + 20s);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart + 15s), Taken::selected) << "made anew";
  selections.Select(1, kTripOutput, kStart + 30s);
  EXPECT_EQ(selections.Take(2, kTripOutput, kStart + 31s), Taken::none) << "over for all";
}

TEST(Selections, TwoClientsMaySelectOnePoint) {
  Selections selections;
  selections.Select(1, kTripOutput, kStart + 10s);
  selections.Select(2, kTripOutput, kStart + 10s);
  EXPECT_EQ(selections.Take(2, kTripOutput, kStart), Taken::selected);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart), Taken::selected);
}

TEST(Selections, OfSeveralOthersEachCounts) {
  Selections selections;
  selections.Select(1, kTripOutput, kStart + 10s);
  selections.Select(2, kTripOutput, kStart + 60s);
  EXPECT_EQ(selections.Take(3, kTripOutput, kStart + 20s), Taken::foreign) << "the second holds";
  EXPECT_EQ(selections.Take(3, kTripOutput, kStart + 60s), Taken::none);
}

TEST(Selections, LeaveWithTheirClient) {
  Selections selections;
  selections.Select(1, kTripOutput, kStart + 10s);
  selections.Select(2, {0, 8}, kStart + 10s);
  selections.Forget(1);
  EXPECT_EQ(selections.Take(1, kTripOutput, kStart), Taken::none);
  EXPECT_EQ(selections.Take(2, {0, 8}, kStart), Taken::selected);
}

TEST(Selections, AreBounded) {
  Selections selections;
  for (std::uint32_t i = 0; i < 3 * Selections::kLimit; ++i) {
    selections.Select(i, {0, i}, kStart + i * 1ms);
  }
  EXPECT_EQ(selections.size(), Selections::kLimit);
  constexpr std::uint32_t kLast = 3 * Selections::kLimit - 1;
  EXPECT_EQ(selections.Take(kLast, {0, kLast}, kStart), Taken::selected) << "the last stay";
}

}  // namespace
}  // namespace baudgate
