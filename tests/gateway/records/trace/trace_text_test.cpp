// Records as lines of text, and the queue between a line and a slow reader.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/trace/trace_text.h"

#include <gtest/gtest.h>

namespace baudgate {
namespace {

constexpr WallTime kTimeOfDay = WallTime(4h + 5min + 6s + 123456us + 789ns);

TEST(ToText, OneLineAKind) {
  TraceRecord record{TraceRecord::Kind::sent, kTimeOfDay, "feeder-1", "3E ** 0D", ">*."};
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 > 3E ** 0D | >*.");
  record.kind = TraceRecord::Kind::received;
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 < 3E ** 0D | >*.");
  record.kind = TraceRecord::Kind::note;
  record.text = "offline: no_reply";
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 # offline: no_reply");
  record.device.clear();
  EXPECT_EQ(ToText(record), "04:05:06.123456 - # offline: no_reply");
}

TEST(ToText, TheEndOfAnExchangeHasOutcomeRoundTripAndReason) {
  TraceRecord record{TraceRecord::Kind::end, kTimeOfDay, "feeder-1", {}, {}};
  record.outcome = Outcome::ok;
  record.round_trip = 19'840us;
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 = ok, 19.8 ms");
  record.outcome = Outcome::no_reply;
  record.round_trip = {};
  record.text = "silence";
  EXPECT_EQ(ToText(record), "04:05:06.123456 feeder-1 = no_reply: silence");
}

TEST(ToText, TheDayDoesNotMatter) {
  const TraceRecord record{TraceRecord::Kind::note, kTimeOfDay + 24h * 20'000, "a", {}, "x"};
  EXPECT_EQ(ToText(record), "04:05:06.123456 a # x");
}

TEST(TraceQueue, WakesOncePerTake) {
  int woken = 0;
  TraceQueue queue([&] { ++woken; });
  queue.Push({});
  queue.Push({});
  EXPECT_EQ(woken, 1);
  EXPECT_EQ(queue.Take().size(), 2U);
  EXPECT_TRUE(queue.Take().empty());
  queue.Push({});
  EXPECT_EQ(woken, 2);
}

TEST(TraceQueue, ANoteStandsInThePlaceOfWhatWasDropped) {
  TraceQueue queue({});
  TraceRecord record;
  for (std::size_t i = 0; i < TraceQueue::kMostRecords + 7; ++i) {
    record.text = std::to_string(i);
    queue.Push(record);
  }
  const auto taken = queue.Take();
  ASSERT_EQ(taken.size(), TraceQueue::kMostRecords + 1);
  EXPECT_EQ(taken.front().text, "0");
  EXPECT_EQ(taken[TraceQueue::kMostRecords - 1].text, std::to_string(TraceQueue::kMostRecords - 1));
  EXPECT_EQ(taken.back().kind, TraceRecord::Kind::note);
  EXPECT_EQ(taken.back().text, "7 records were dropped: the reader is too slow");
  queue.Push(record);
  EXPECT_EQ(queue.Take().size(), 1U) << "told once";
}

}  // namespace
}  // namespace baudgate
