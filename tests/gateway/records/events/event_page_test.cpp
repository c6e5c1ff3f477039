// The table of events: what goes in comes out page by page, and the oldest make room.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/disk/events_file.h"
#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_source.h"
#include "tests/gateway/records/audit/faulty_disk.h"

namespace baudgate::events {
namespace {

constexpr WallTime kWall = WallTime(std::chrono::hours(498'000));

EventRecord RecordOf(std::int64_t seq, const std::string& device = "feeder-1") {
  EventRecord record;
  record.seq = seq;
  record.received = kWall + seq * 1s;
  record.device_time = kWall + seq * 1s - 250ms;
  record.clock = ClockQuality::device;
  record.line = "bay-1";
  record.device = device;
  record.channel = 2;
  record.code = 12;
  record.state = config::EventState::on;
  record.text = "stage I> started";
  return record;
}

class EventPageTest : public ::testing::Test {
 protected:
  EventPageTest() : opened_(OpenEvents("/events.db", disk_.vfs())) {}

  Page Read(const PageQuery& query) {
    auto page = ReadPage(*opened_.database, query);
    EXPECT_TRUE(page) << page.error();
    return page ? *page : Page();
  }

  audit::FaultyDisk disk_;
  OpenedEvents opened_;
};

TEST_F(EventPageTest, GivesBackWhatWentIn) {
  EventTable table(*opened_.database);
  ASSERT_TRUE(table.Write({{.source = 0,
                            .said = "12.345 0E1",
                            .events = {RecordOf(1), RecordOf(2)},
                            .line = "bay-1",
                            .device = "feeder-1"},
                           {.source = 1,
                            .said = "x",
                            .events = {RecordOf(3, "feeder-2")},
                            .line = "bay-1",
                            .device = "feeder-2"}}));
  const Page page = Read({});
  ASSERT_EQ(page.records.size(), 3U);
  const EventRecord& first = page.records[0];
  const EventRecord expected = RecordOf(1);
  EXPECT_EQ(first.seq, 1);
  EXPECT_EQ(first.received, expected.received);
  EXPECT_EQ(first.device_time, expected.device_time);
  EXPECT_EQ(first.clock, expected.clock);
  EXPECT_EQ(first.line, "bay-1");
  EXPECT_EQ(first.device, "feeder-1");
  EXPECT_EQ(first.channel, 2U);
  EXPECT_EQ(first.code, 12U);
  EXPECT_EQ(first.state, config::EventState::on);
  EXPECT_EQ(first.text, "stage I> started");
  EXPECT_EQ(page.next, 3);
  EXPECT_FALSE(page.more);
  EXPECT_EQ(Read({.device = "feeder-2"}).records.size(), 1U);
  EXPECT_EQ(Read({.line = "bay-2"}).records.size(), 0U);
  EXPECT_EQ(Read({.after = 2}).records.size(), 1U);
  EXPECT_EQ(Read({.since = kWall + 2s}).records.size(), 2U);
  const auto contents = table.Read();
  EXPECT_TRUE(contents.ok);
  EXPECT_EQ(contents.last, 3);
  EXPECT_EQ(contents.said,
            (Said{{{"bay-1", "feeder-1"}, "12.345 0E1"}, {{"bay-1", "feeder-2"}, "x"}}));
}

TEST_F(EventPageTest, KeepsTheNewestWhereThereIsNoRoom) {
  EventTable table(*opened_.database, 3);
  for (std::int64_t seq = 1; seq <= 10; ++seq) {
    ASSERT_TRUE(table.Write({{0, std::to_string(seq), false, {RecordOf(seq)}}}));
  }
  const Page page = Read({});
  ASSERT_EQ(page.records.size(), 3U);
  EXPECT_EQ(page.records.front().seq, 8);
}

TEST_F(EventPageTest, ComesInPages) {
  EventTable table(*opened_.database);
  std::vector<EventRecord> records;
  for (std::int64_t seq = 1; seq <= 2 * static_cast<std::int64_t>(kPage); ++seq) {
    records.push_back(RecordOf(seq));
  }
  ASSERT_TRUE(table.Write({{0, "x", false, records}}));
  const Page first = Read({});
  EXPECT_EQ(first.records.size(), kPage);
  EXPECT_TRUE(first.more);
  const Page second = Read({.after = first.next});
  EXPECT_EQ(second.records.size(), kPage);
  EXPECT_FALSE(second.more);
}

TEST_F(EventPageTest, BelievesNothingThatStandsInTheFile) {
  ASSERT_TRUE(opened_.database->Execute(
      "INSERT INTO events VALUES (1, 9223372036854775807, 'when', -5, x'00', 'd', -1, 1e30, 'up', "
      "'t')"));
  const Page page = Read({});
  ASSERT_EQ(page.records.size(), 1U);
  EXPECT_EQ(page.records[0].clock, ClockQuality::none);
  EXPECT_EQ(page.records[0].channel, 0U);
  EXPECT_EQ(page.records[0].state, config::EventState::message);
}

}  // namespace
}  // namespace baudgate::events
