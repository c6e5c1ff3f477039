// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/base/time.h"

namespace baudgate {
namespace {

constexpr Instant kNow{1h};

TEST(Deadline, TheSoonestOfSeveralIsTheOneThatComesFirst) {
  EXPECT_EQ(Soonest({kNow + 2s, std::nullopt, kNow + 1s}), kNow + 1s);
  EXPECT_EQ(Soonest({std::nullopt, std::nullopt}), std::nullopt);
}

TEST(Deadline, HasComeAtItsVeryTimeAndNeverWithoutOne) {
  EXPECT_TRUE(HasCome(kNow, kNow));
  EXPECT_FALSE(HasCome(kNow + 1ns, kNow));
  EXPECT_FALSE(HasCome(std::nullopt, kNow));
}

}  // namespace
}  // namespace baudgate
