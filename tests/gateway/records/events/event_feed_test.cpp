// Tests of `EventFeed`, which shows events to outputs, and of the table of events.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_feed.h"

#include <gtest/gtest.h>

#include "gateway/records/disk/events_file.h"
#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_source.h"
#include "tests/gateway/records/audit/faulty_disk.h"

namespace baudgate::events {
namespace {

constexpr std::optional<Source> kAll = std::nullopt;
constexpr std::size_t kMost = 7;

class Events {
 public:
  std::vector<Batch> Of(const std::vector<Source>& sources) {
    std::vector<Batch> batches;
    for (const Source source : sources) {
      EventRecord record;
      record.seq = ++seq_;
      record.line = "bay-1";
      record.device = source == 0 ? "feeder-1" : "feeder-2";
      record.text = "event " + std::to_string(seq_);
      batches.push_back({source, record.text, false, {record}});
    }
    return batches;
  }
  std::vector<Batch> Many(Source source, std::size_t count) {
    return Of(std::vector<Source>(count, source));
  }

 private:
  std::int64_t seq_ = 0;
};

const SourceNames kFeeders = {{"bay-1", "feeder-1"}, {"bay-1", "feeder-2"}};

std::vector<EventRecord> Fed(const std::vector<Batch>& batches) {
  std::vector<EventRecord> events;
  for (const Batch& batch : batches) events.push_back(batch.events.front());
  return events;
}

std::vector<std::int64_t> Numbers(const std::vector<EventRecord>& records) {
  std::vector<std::int64_t> numbers;
  for (const EventRecord& record : records) numbers.push_back(record.seq);
  return numbers;
}

using Seqs = std::vector<std::int64_t>;

TEST(EventFeed, IsEmptyBeforeTheFirstEvent) {
  const EventFeed feed;
  for (const std::uint32_t first : {0U, 1U, 0xFFFFFFFFU}) {
    const auto shown = feed.Show(kAll, first, kMost);
    EXPECT_EQ(shown.newest, 0);
    EXPECT_EQ(shown.oldest, 0);
    EXPECT_EQ(shown.lost, 0U);
    EXPECT_TRUE(shown.events.empty());
  }
}

TEST(EventFeed, ShowsTheNewestEventsOrThoseFromANumber) {
  EventFeed feed;
  feed.Renumber(kFeeders);
  Events events;
  feed.Add(Fed(events.Of({0, 1, 0, 1, 1, 1, 1, 1, 1, 1})));
  const struct {
    std::optional<Source> source;
    std::uint32_t first;
    Seqs expected;
  } cases[] = {
      {kAll, 0, {4, 5, 6, 7, 8, 9, 10}},
      {kAll, 1, {1, 2, 3, 4, 5, 6, 7}},
      {kAll, 9, {9, 10}},
      {kAll, 11, {}},
      {kAll, 0xFFFFFFFF, {}},
      {Source{0}, 0, {1, 3}},
      {Source{0}, 2, {3}},
      {Source{0}, 4, {}},
      {Source{1}, 3, {4, 5, 6, 7, 8, 9, 10}},
      {Source{2}, 0, {}},
  };
  for (const auto& c : cases) {
    const auto shown = feed.Show(c.source, c.first, kMost);
    EXPECT_EQ(Numbers(shown.events), c.expected) << c.first;
    EXPECT_EQ(shown.newest, 10);
    EXPECT_EQ(shown.oldest, 1);
    EXPECT_EQ(shown.lost, 0U) << c.first;
  }
}

/// The feed holds 3 events and the owners of 4 more: events 1…5 are forgotten, of 6…9 only the
/// owners are known, and 10…12 are shown.
TEST(EventFeed, CountsLostEventsPerDevice) {
  EventFeed feed({.events = 3, .remembered = 4});
  feed.Renumber(kFeeders);
  Events events;
  feed.Add(Fed(events.Of({0, 0, 1, 1, 1, 0, 1, 0, 1, 1, 1, 0})));
  const struct {
    std::optional<Source> source;
    std::uint32_t first;
    std::uint64_t lost;
  } cases[] = {
      {kAll, 10, 0},      {kAll, 9, 1},       {kAll, 1, 9},       {Source{0}, 9, 0},
      {Source{0}, 8, 1},  {Source{0}, 6, 2},  {Source{0}, 3, 2},  {Source{1}, 7, 2},
      {Source{1}, 6, 2},  {Source{0}, 2, 6},  {Source{1}, 5, 3},  {Source{2}, 1, 0},
      {Source{1}, 10, 0}, {Source{1}, 11, 0}, {Source{1}, 13, 0},
  };
  for (const auto& c : cases) {
    const auto shown = feed.Show(c.source, c.first, kMost);
    EXPECT_EQ(shown.lost, c.lost) << c.first << " of " << c.source.value_or(99);
    EXPECT_EQ(shown.oldest, 10);
  }
}

TEST(EventFeed, FindsNumbersBeyond32BitsByTheirLowBits) {
  constexpr std::int64_t kTurn = std::int64_t{1} << 32;
  EventFeed feed;
  FeedImage image;
  for (const std::int64_t seq : {kTurn - 2, kTurn - 1, kTurn, kTurn + 1}) {
    image.events.emplace_back().seq = seq;
    image.newest = seq;
  }
  feed.Begin(image);
  EXPECT_EQ(Numbers(feed.Show(kAll, 0xFFFFFFFF, kMost).events),
            (Seqs{kTurn - 1, kTurn, kTurn + 1}));
  EXPECT_EQ(Numbers(feed.Show(kAll, 1, kMost).events), (Seqs{kTurn + 1}));
}

TEST(EventFeed, GivesConsumersTheEventsBehindTheirPosition) {
  EventFeed feed({.events = 3, .remembered = 0});
  feed.Renumber(kFeeders);
  Events events;
  int woken = 0;
  int other = 0;
  const auto first = feed.listeners().Listen([&] { ++woken; });
  feed.listeners().Listen([&] { ++other; });
  EXPECT_TRUE(feed.Take(0, 10).empty());
  feed.Add(Fed(events.Of({0, 1})));
  EXPECT_EQ(feed.Take(0, 1).size(), 1U);
  EXPECT_EQ(feed.Take(1, 10).front().record.seq, 2);
  EXPECT_EQ(feed.Take(1, 10).front().source, 1U);
  feed.Add(Fed(events.Of({0, 0, 0})));
  const auto late = feed.Take(1, 10);
  ASSERT_EQ(late.size(), 3U);
  EXPECT_EQ(late.front().record.seq, 3) << "2 has left, which whoever was at 1 can count";
  EXPECT_TRUE(feed.Take(5, 10).empty());
  feed.listeners().Leave(first);
  feed.Add(Fed(events.Of({0})));
  EXPECT_EQ(woken, 2);
  EXPECT_EQ(other, 3);
}

TEST(EventFeed, BeginsWithTheFileOnce) {
  audit::FaultyDisk disk;
  const auto opened = records::OpenEvents("/events.db", disk.vfs());
  Events events;
  EventTable table(*opened.database);
  ASSERT_TRUE(table.Write(events.Of({0, 1, 1, 0})));
  ASSERT_TRUE(table.Write(events.Many(1, 300)));

  EventTable again(*opened.database);
  const FeedLimits limits{.events = 250, .remembered = 51};
  auto contents = again.Read(limits);
  ASSERT_TRUE(contents.ok);
  EXPECT_EQ(contents.image.events.size(), 250U);
  EXPECT_EQ(contents.image.gone.size(), 51U);
  EventFeed feed(limits);
  feed.Renumber({{"bay-2", "feeder-3"}, {"bay-2", "feeder-1"}});
  int woken = 0;
  feed.listeners().Listen([&] { ++woken; });
  feed.Begin(contents.image);
  auto shown = feed.Show(kAll, 4, kMost);
  EXPECT_EQ(shown.newest, 304);
  EXPECT_EQ(shown.oldest, 55);
  EXPECT_EQ(shown.lost, 51U);
  EXPECT_EQ(shown.events.front().text, "event 55");
  EXPECT_EQ(feed.Show(Source{0}, 1, kMost).lost, 0U);
  EXPECT_EQ(feed.Show(Source{1}, 4, kMost).lost, 1U);
  EXPECT_EQ(feed.Show(Source{1}, 2, kMost).lost, 1U) << "its newest before these is 1";
  EXPECT_EQ(feed.Show(Source{1}, 1, kMost).lost, 4U) << "4, and three of which not all are known";
  EXPECT_EQ(feed.Take(0, 1).front().source, kGateway);

  feed.Begin(contents.image);
  EXPECT_EQ(feed.Take(0, 1000).size(), 250U);
  EXPECT_EQ(woken, 1);
}

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
  EventPageTest() : opened_(records::OpenEvents("/events.db", disk_.vfs())) {}

  Page Read(const PageQuery& query) {
    auto page = ReadPage(*opened_.database, query);
    EXPECT_TRUE(page) << page.error();
    return page ? *page : Page();
  }

  audit::FaultyDisk disk_;
  records::OpenedEvents opened_;
};

TEST_F(EventPageTest, StoredEventsAreReadBack) {
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
  EXPECT_EQ(Read({.until = kWall + 2s}).records.size(), 1U);
  EXPECT_EQ(Read({.state = config::EventState::on}).records.size(), 3U);
  EXPECT_EQ(Read({.state = config::EventState::off}).records.size(), 0U);
  EXPECT_EQ(Read({.text = "STAGE i>"}).records.size(), 3U);
  EXPECT_EQ(Read({.text = "stage_"}).records.size(), 0U) << "no pattern";
  EXPECT_EQ(Read({.after = 1, .device = "feeder-1", .text = "started"}).records.size(), 1U);
  const auto contents = table.Read();
  EXPECT_TRUE(contents.ok);
  EXPECT_EQ(contents.last, 3);
  EXPECT_EQ(contents.said,
            (Said{{{"bay-1", "feeder-1"}, "12.345 0E1"}, {{"bay-1", "feeder-2"}, "x"}}));
}

TEST_F(EventPageTest, KeepsTheNewestEventsWithinTheLimit) {
  EventTable table(*opened_.database, 3);
  for (std::int64_t seq = 1; seq <= 10; ++seq) {
    ASSERT_TRUE(table.Write({{0, std::to_string(seq), false, {RecordOf(seq)}}}));
  }
  const Page page = Read({});
  ASSERT_EQ(page.records.size(), 3U);
  EXPECT_EQ(page.records.front().seq, 8);
}

TEST_F(EventPageTest, EventsAreReadInPages) {
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

TEST_F(EventPageTest, InvalidValuesInTheFileAreReplaced) {
  ASSERT_TRUE(opened_.database->Execute(
      "INSERT INTO events VALUES (1, 9223372036854775807, 'when', -5, x'00', 'd', -1, 1e30, 'up', "
      "'t', 'loud')"));
  const Page page = Read({});
  ASSERT_EQ(page.records.size(), 1U);
  EXPECT_EQ(page.records[0].clock, ClockQuality::none);
  EXPECT_EQ(page.records[0].channel, 0U);
  EXPECT_EQ(page.records[0].state, config::EventState::message);
  EXPECT_EQ(PriorityOf(page.records[0]), config::AlarmPriority::none);
}

TEST(CursorBook, ContinuesAtThePositionInTheFile) {
  CursorBook book({"dds"});
  EXPECT_FALSE(book.Of("dds"));
  EXPECT_FALSE(book.Due());
  book.OnOpened({{"dds", {40, true}}});
  EXPECT_EQ(book.Of("dds"), (Cursor{40, true}));
  EXPECT_FALSE(book.Due()) << "the file has it so";
  EXPECT_TRUE(book.Set("dds", {41, false}));
  EXPECT_FALSE(book.Set("dds", {42, false})) << "the file is to hear of it already";
  const auto due = book.Due();
  ASSERT_TRUE(due);
  EXPECT_EQ(*due, (Cursors{{"dds", {42, false}}}));
  book.Set("dds", {43, false});
  book.OnKept(*due);
  EXPECT_TRUE(book.Due()) << "what came meanwhile";
  book.OnKept(*book.Due());
  EXPECT_FALSE(book.Due());
  EXPECT_FALSE(book.Set("dds", {43, false}));
}

TEST(CursorBook, ForgetsRemovedConsumers) {
  CursorBook book({"dds"});
  book.OnOpened({{"dds", {4, true}}, {"mqtt", {2, true}}});
  EXPECT_FALSE(book.Of("mqtt"));
  EXPECT_EQ(*book.Due(), (Cursors{{"dds", {4, true}}})) << "the file's is removed";
  EXPECT_FALSE(book.Set("page", {1, true}));
  EXPECT_FALSE(book.Of("page"));
}

TEST(CursorBook, StoresPositionsInANewFile) {
  CursorBook book({"dds"});
  book.OnOpened({});
  book.Set("dds", {7, false});
  book.OnKept(*book.Due());
  book.OnOpened({});
  EXPECT_EQ(*book.Due(), (Cursors{{"dds", {7, false}}})) << "numbers go on in it";
}

std::vector<EventRecord> EventsOf(std::int64_t first, std::int64_t last) {
  std::vector<EventRecord> events;
  for (; first <= last; ++first) events.emplace_back().seq = first;
  return events;
}

TEST(Backlog, IsReadForEachConsumer) {
  Backlog backlog;
  EXPECT_FALSE(backlog.wanted());
  EXPECT_FALSE(backlog.Take(40, 2));
  EXPECT_FALSE(backlog.Take(7, 2)) << "another";
  EXPECT_EQ(backlog.wanted(), 7);
  backlog.Supply(7, EventsOf(8, 9));
  EXPECT_EQ(backlog.wanted(), 40);
  backlog.Supply(40, EventsOf(41, 45));
  EXPECT_FALSE(backlog.wanted());
  EXPECT_EQ(backlog.Take(40, 2)->back().seq, 42);
  EXPECT_EQ(backlog.Take(42, 2)->back().seq, 44);
  EXPECT_EQ(backlog.Take(44, 2)->back().seq, 45);
  EXPECT_FALSE(backlog.Take(45, 2)) << "it is to be read";
  EXPECT_EQ(backlog.Take(7, 2)->size(), 2U);
}

TEST(Backlog, DoesNotWaitForMissingEvents) {
  Backlog backlog;
  EXPECT_FALSE(backlog.Take(3, 9));
  backlog.Supply(3, {});
  EXPECT_TRUE(backlog.Take(3, 9)->empty());
}

}  // namespace
}  // namespace baudgate::events
