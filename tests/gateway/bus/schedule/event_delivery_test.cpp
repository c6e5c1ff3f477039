// Events from the reply that tells them to the disk.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/bus/schedule/effects.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate {
namespace {

class EventDeliveryTest : public ::testing::Test, protected ToyMembers {
 protected:
  static EventBatch Batch(std::size_t events, bool drained = false) {
    EventBatch batch;
    batch.events.resize(events);
    batch.drained = drained;
    return batch;
  }
  static EventDelivery::Exchange At(Duration asked, bool background = false) {
    const Duration answered = asked + 100ms;
    return {kStart + asked, {kStart + answered, kWall + answered}, background};
  }

  EventDelivery told_;
};

TEST_F(EventDeliveryTest, HowOldAnEventCanBe) {
  struct Row {
    const char* what;
    Duration asked;
    std::size_t events;
    bool drained;
    bool kept;
    std::optional<Duration> oldest;
  };
  const Row kRows[] = {
      {"nobody knows when it was empty", 1s, 2, false, true, std::nullopt},
      {"nothing is left", 2s, 0, true, false, std::nullopt},
      {"since then", 5s, 1, false, true, 3100ms},
      {"and still", 6s, 1, false, true, 4100ms},
      {"nothing is said, and something may be left", 7s, 0, false, false, std::nullopt},
      {"the last ones: the device has looked since it was asked", 8s, 1, true, true, 100ms},
      {"since the last ones", 9s, 1, false, true, 1100ms},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.what);
    const auto events = told_.Take(a, Batch(row.events, row.drained), At(row.asked));
    ASSERT_EQ(events.has_value(), row.kept);
    if (!events) continue;
    EXPECT_EQ(events->device, a.index);
    EXPECT_EQ(events->batch.events.size(), row.events);
    EXPECT_EQ(events->received.instant, kStart + row.asked + 100ms);
    EXPECT_EQ(events->received.wall, kWall + row.asked + 100ms);
    EXPECT_EQ(events->oldest, row.oldest);
  }
}

TEST_F(EventDeliveryTest, RecordsOfThePastAreKeptToo) {
  EventBatch batch;
  batch.past.resize(1);
  EXPECT_TRUE(told_.Take(a, batch, At(1s)));
}

TEST_F(EventDeliveryTest, EachDeviceIsDrainedByItself) {
  told_.Take(a, Batch(0, true), At(1s));
  EXPECT_EQ(told_.Take(b, Batch(1), At(2s))->oldest, std::nullopt);
  EXPECT_EQ(told_.Take(a, Batch(1), At(2s))->oldest, 1100ms);
}

TEST_F(EventDeliveryTest, WhenAnotherDeviceWasDrainedIsNotKnown) {
  told_.Take(a, Batch(0, true), At(1s));
  told_.OnReplaced(a);
  EXPECT_EQ(told_.Take(a, Batch(1), At(2s))->oldest, std::nullopt);
}

TEST_F(EventDeliveryTest, WhatAKeptBatchHasBrought) {
  using Brought = Schedule::Brought;
  struct Row {
    const char* what;
    bool background;
    const char* said;
    Brought brought;
  };
  const Row kRows[] = {
      {"the first one", false, "A", Brought::news},
      {"another one", false, "B", Brought::news},
      {"the same once more", false, "B", Brought::no_news},
      {"in the background", true, "C", Brought::something_else},
      {"the same once more, asked for", false, "C", Brought::no_news},
      {"the same once more, in the background", true, "C", Brought::something_else},
  };
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.what);
    told_.Take(a, Batch(1), At(1s, row.background));
    EXPECT_EQ(told_.OnKept(a, row.said), row.brought);
  }
}

TEST_F(EventDeliveryTest, WhatWasKeptBeforeARestartIsKnown) {
  EXPECT_EQ(told_.OnKept(a, "A"), Schedule::Brought::news);
  told_.Take(a, Batch(1), At(1s));
  EXPECT_EQ(told_.OnKept(a, "A"), Schedule::Brought::no_news);
  EXPECT_EQ(told_.OnKept(b, "A"), Schedule::Brought::news) << "of another device";
}

}  // namespace
}  // namespace baudgate
