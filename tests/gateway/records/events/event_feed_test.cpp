// What outputs see of the events on the disk: in order, bounded, by device, and what is missing.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_feed.h"

#include <gtest/gtest.h>

#include "gateway/records/disk/events_file.h"
#include "gateway/records/events/event_file.h"
#include "tests/gateway/records/audit/faulty_disk.h"

namespace baudgate::events {
namespace {

constexpr std::optional<Source> kAll = std::nullopt;
constexpr std::size_t kMost = 7;

/// One event for each source, numbered on.
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

TEST(EventFeed, ShowsNothingBeforeThereIsAny) {
  const EventFeed feed;
  for (const std::uint32_t first : {0U, 1U, 0xFFFFFFFFU}) {
    const auto shown = feed.Show(kAll, first, kMost);
    EXPECT_EQ(shown.newest, 0);
    EXPECT_EQ(shown.oldest, 0);
    EXPECT_EQ(shown.lost, 0U);
    EXPECT_TRUE(shown.events.empty());
  }
}

TEST(EventFeed, ShowsTheNewestOrFromANumberOn) {
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

/// Room for 3, and the owners of 4 more: of 12 events 1…5 are old, 6…9 gone, 10…12 shown.
TEST(EventFeed, CountsWhatADeviceHasLostAndNotWhatOthersHave) {
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

TEST(EventFeed, KnowsNumbersBeyond32BitsByTheirLowOnes) {
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

TEST(EventFeed, GivesConsumersWhatIsBehindTheirPlace) {
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

TEST(EventFeed, BeginsWithTheFileAndOnlyOnce) {
  audit::FaultyDisk disk;
  const auto opened = OpenEvents("/events.db", disk.vfs());
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
  // The second has been taken out of the configuration, the first moved to another line.
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

}  // namespace
}  // namespace baudgate::events
