// Values that wait for the disk: the numbers of their runs, and how many of them may wait.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/records/history/batch.h"

namespace baudgate::history {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

Batch Of(std::int64_t run, Millis began, Millis until, std::vector<Millis> times) {
  Batch batch;
  batch.runs = {{.number = run, .began = began, .until = until}};
  for (const Millis time : times) {
    batch.samples.push_back({.run = run, .entry = {.time = time, .value = 1.0}});
  }
  return batch;
}

TEST(PendingValues, ContinueTheRunsOfTheFiles) {
  PendingValues pending;
  EXPECT_FALSE(pending.has_begun());
  pending.Begin(40);
  pending.Add(Of(1, 100, 200, {100}));
  ASSERT_THAT(pending.batch().runs, SizeIs(1));
  EXPECT_EQ(pending.batch().runs[0].number, 41);
  EXPECT_EQ(pending.batch().samples[0].run, 41);
  EXPECT_FALSE(pending.TakeLost());
}

TEST(PendingValues, BeginAnotherRunWhereTheFileOfTheFirstIsLost) {
  PendingValues pending;
  pending.Begin(40);
  pending.Add(Of(1, 100, 200, {150}));
  pending.CutRun();
  pending.Add(Of(1, 100, 300, {250}));
  ASSERT_THAT(pending.batch().runs, SizeIs(1));
  EXPECT_EQ(pending.batch().runs[0].number, 42);
  EXPECT_EQ(pending.batch().runs[0].began, 150) << "nothing is known of the time before";
  EXPECT_EQ(pending.batch().runs[0].until, 300);
  EXPECT_EQ(pending.batch().runs[0].why, RunBegin::dropped);
  EXPECT_EQ(pending.batch().samples[1].run, 42);
  EXPECT_TRUE(pending.TakeLost());
  EXPECT_FALSE(pending.TakeLost());
}

TEST(BatchQueue, HasPlacesForSamplesAndOthersForSpans) {
  BatchQueue queue(3);
  EXPECT_EQ(queue.Add(Of(1, 0, 200, {100, 101})), 0U);
  EXPECT_EQ(queue.Room(), 1U);
  Batch spans;
  spans.trends.resize(2);
  EXPECT_EQ(queue.Add(Batch(spans)), 0U);
  EXPECT_EQ(queue.Add(Batch(spans)), 2U) << "the queue has room for one of them only";
  const Batch all = queue.TakeAll();
  EXPECT_THAT(all.samples, SizeIs(2));
  EXPECT_THAT(all.trends, SizeIs(2));
  EXPECT_EQ(queue.Room(), 3U);
  EXPECT_THAT(queue.TakeAll().samples, IsEmpty());
}

}  // namespace
}  // namespace baudgate::history
