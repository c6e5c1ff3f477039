// Who has selected what, and until when.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/writes/selections.h"

#include <gtest/gtest.h>

#include "tests/support/times.h"

namespace baudgate {
namespace {

using Verdict = Selections::Verdict;

constexpr Selections::Point kTrip{0, 7};

TEST(Selections, AreGoodOnceAndForTheirOwner) {
  Selections selections;
  EXPECT_EQ(selections.Take(1, kTrip, kStart), Verdict::none);
  selections.Select(1, kTrip, kStart + 10s);
  EXPECT_EQ(selections.Take(2, kTrip, kStart + 1s), Verdict::foreign);
  EXPECT_EQ(selections.Take(1, {0, 8}, kStart + 1s), Verdict::none) << "another point";
  EXPECT_EQ(selections.Take(1, {1, 7}, kStart + 1s), Verdict::none) << "another device";
  EXPECT_EQ(selections.Take(1, kTrip, kStart + 2s), Verdict::selected);
  EXPECT_EQ(selections.Take(1, kTrip, kStart + 3s), Verdict::none) << "used up";
}

TEST(Selections, End) {
  Selections selections;
  selections.Select(1, kTrip, kStart + 10s);
  EXPECT_EQ(selections.Take(1, kTrip, kStart + 10s), Verdict::expired);
  EXPECT_EQ(selections.Take(1, kTrip, kStart + 10s), Verdict::none) << "told once";
  selections.Select(1, kTrip, kStart + 10s);
  selections.Select(1, kTrip, kStart + 20s);
  EXPECT_EQ(selections.Take(1, kTrip, kStart + 15s), Verdict::selected) << "made anew";
  selections.Select(1, kTrip, kStart + 30s);
  EXPECT_EQ(selections.Take(2, kTrip, kStart + 31s), Verdict::none) << "over for all";
}

TEST(Selections, TwoClientsMaySelectOnePoint) {
  Selections selections;
  selections.Select(1, kTrip, kStart + 10s);
  selections.Select(2, kTrip, kStart + 10s);
  EXPECT_EQ(selections.Take(2, kTrip, kStart), Verdict::selected);
  EXPECT_EQ(selections.Take(1, kTrip, kStart), Verdict::selected);
}

TEST(Selections, LeaveWithTheirClient) {
  Selections selections;
  selections.Select(1, kTrip, kStart + 10s);
  selections.Select(2, {0, 8}, kStart + 10s);
  selections.Forget(1);
  EXPECT_EQ(selections.Take(1, kTrip, kStart), Verdict::none);
  EXPECT_EQ(selections.Take(2, {0, 8}, kStart), Verdict::selected);
}

TEST(Selections, AreBounded) {
  Selections selections;
  for (std::uint32_t i = 0; i < 3 * Selections::kLimit; ++i) {
    selections.Select(i, {0, i}, kStart + i * 1ms);
  }
  EXPECT_EQ(selections.size(), Selections::kLimit);
  constexpr std::uint32_t kLast = 3 * Selections::kLimit - 1;
  EXPECT_EQ(selections.Take(kLast, {0, kLast}, kStart), Verdict::selected) << "the last stay";
}

}  // namespace
}  // namespace baudgate
