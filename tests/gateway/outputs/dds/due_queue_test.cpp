// The due queue against a plain list that is searched each time.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "gateway/outputs/dds/publish_plan.h"
#include "tests/support/times.h"

namespace baudgate::dds {
namespace {

TEST(DueQueue, IsEmptyWithoutSlots) {
  DueQueue queue(0, kStart);
  EXPECT_EQ(queue.Due(kStart), std::nullopt);
  EXPECT_EQ(queue.Next(), Instant::max());
}

TEST(DueQueue, GivesASlotOnlyWhenItsTimeHasCome) {
  DueQueue queue(1, kStart);
  EXPECT_EQ(queue.Due(kStart - 1ns), std::nullopt);
  EXPECT_EQ(queue.Due(kStart), 0U);
  queue.Set(0, kStart + 10s);
  EXPECT_EQ(queue.Due(kStart + 9s), std::nullopt);
  queue.Set(0, kStart + 5s);
  EXPECT_EQ(queue.Due(kStart + 9s), 0U);
}

TEST(DueQueue, AgreesWithAPlainSearch) {
  constexpr std::size_t kCount = 50;
  std::mt19937 random(1);
  DueQueue queue(kCount, kStart);
  std::vector<Instant> plain(kCount, kStart);
  Instant now = kStart;
  for (int step = 0; step < 20'000; ++step) {
    const auto slot = static_cast<std::uint32_t>(random() % kCount);
    const Instant due = now + Duration(random() % 1000);
    queue.Set(slot, due);
    plain[slot] = due;
    now += Duration(random() % 20);
    const auto earliest = std::ranges::min_element(plain);
    ASSERT_LE(queue.Next(), *earliest);
    const auto got = queue.Due(now);
    ASSERT_EQ(got.has_value(), *earliest <= now);
    if (!got) continue;
    ASSERT_LE(plain[*got], now);
    const Instant next = now + 500ns;
    queue.Set(*got, next);
    plain[*got] = next;
  }
}

}  // namespace
}  // namespace baudgate::dds
