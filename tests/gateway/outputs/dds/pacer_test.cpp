// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {
namespace {

constexpr Instant kStart{1h};

TEST(Pacer, LetsABurstThroughAndThenSlowsDown) {
  Pacer pacer(50us, 100);
  int burst = 0;
  while (pacer.Take(kStart)) ++burst;
  EXPECT_EQ(burst, 100);
  EXPECT_FALSE(pacer.Take(kStart + 49us));
  EXPECT_TRUE(pacer.Take(kStart + 50us));
}

TEST(Pacer, KeepsItsRateWhenItIsWokenAsItAsks) {
  Pacer pacer(50us, 100);
  Instant now = kStart;
  int sent = 0;
  int waits = 0;
  while (now < kStart + 100ms) {
    while (pacer.Take(now)) ++sent;
    ASSERT_GT(pacer.ReadyAt(), now);
    now = pacer.ReadyAt();
    ++waits;
  }
  EXPECT_NEAR(sent, 2000 + 100, 60);
  EXPECT_LE(waits, 45);  // half a burst each time
}

}  // namespace
}  // namespace baudgate::dds
