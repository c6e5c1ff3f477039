// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_book.h"

#include <gmock/gmock.h>

namespace baudgate::events {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

SourceName NameOf(Source source) { return {"bay", std::to_string(source)}; }

Batch BatchOf(Source source, const std::string& said, std::size_t events, bool again = false) {
  const auto [line, device] = NameOf(source);
  return {.source = source,
          .said = said,
          .again = again,
          .events = std::vector<EventRecord>(events),
          .line = line,
          .device = device};
}

std::vector<std::int64_t> Numbers(const std::vector<Batch>& batches) {
  std::vector<std::int64_t> numbers;
  for (const Batch& batch : batches) {
    for (const EventRecord& event : batch.events) numbers.push_back(event.seq);
  }
  return numbers;
}

TEST(EventBook, GivesNumbersWithoutAGapInTheOrderOfComing) {
  EventBook book;
  book.OnOpened(0, {});
  book.Add(BatchOf(1, "a", 2));
  book.Add(BatchOf(0, "b", 1));
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(1, 2, 3));
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(1, 2, 3)) << "the same until they are kept";
  EXPECT_EQ(book.newest(), 0);
  EXPECT_THAT(book.Kept(2), ElementsAre(NameOf(1), NameOf(0)));
  EXPECT_EQ(book.newest(), 3);
  book.Add(BatchOf(1, "c", 1));
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(4));
}

TEST(EventBook, GoesOnBehindWhatTheFileHolds) {
  EventBook book;
  book.Add(BatchOf(0, "a", 1));
  book.OnOpened(41, {});
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(42));
  book.Kept(1);
  book.OnOpened(0, {});
  book.Add(BatchOf(0, "b", 1));
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(43)) << "in a new file no number comes twice";
}

TEST(EventBook, KnowsWhatComesOnceMore) {
  EventBook book;
  book.OnOpened(7, {{NameOf(0), "a"}, {NameOf(1), "x"}});
  book.Add(BatchOf(0, "a", 2, true));  // of before the restart
  book.Add(BatchOf(1, "y", 1, true));  // that was not kept then
  book.Add(BatchOf(2, "a", 1, true));  // another device's
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(8, 9));
  EXPECT_THAT(book.Kept(3), ElementsAre(NameOf(0), NameOf(1), NameOf(2)))
      << "all may be asked for more";
  EXPECT_EQ(book.repeats(), 2U);
  book.Add(BatchOf(0, "a", 1));
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(10)) << "not asked again: it has happened again";
  book.Kept(1);
  book.Add(BatchOf(0, "b", 1));
  book.Add(BatchOf(0, "b", 1, true));
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(11)) << "behind one that waits";
  book.Kept(2);
  EXPECT_EQ(book.newest(), 11);
  EXPECT_EQ(book.repeats(), 3U);
}

TEST(EventBook, TakesMoreWhileSomeAreWritten) {
  EventBook book;
  book.OnOpened(0, {});
  book.Add(BatchOf(0, "a", 1));
  const std::size_t written = book.Prepare().size();
  book.Add(BatchOf(1, "b", 1));
  EXPECT_THAT(book.Kept(written), ElementsAre(NameOf(0)));
  EXPECT_EQ(book.waiting(), 1U);
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(2));
}

TEST(EventBook, TakesTheGatewaysOwnAmongTheOthers) {
  EventBook book;
  book.OnOpened(0, {});
  book.Add(BatchOf(1, "a", 1));
  book.Tell({}, Instant());
  book.Add(BatchOf(2, "a", 1));
  book.TellFirst({});
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(book.waiting(), 2U) << "of devices";
  EXPECT_EQ(book.waiting_own(), 2U);
  EXPECT_THAT(book.Kept(4), ElementsAre(NameOf(1), NameOf(2)));
  EXPECT_TRUE(book.empty());
  EXPECT_EQ(book.newest(), 4);
}

TEST(EventBook, HasRoomForSoManyOfItsOwn) {
  EventBook book;
  book.OnOpened(0, {});
  for (std::uint32_t i = 0; i < EventBook::kMostOwn + 5; ++i) {
    EventRecord record;
    record.code = i;
    book.Tell(record, Instant());
  }
  EXPECT_EQ(book.waiting_own(), EventBook::kMostOwn);
  EXPECT_EQ(book.left_out(), 5U);
  book.Kept(book.Prepare().size());
  EXPECT_TRUE(book.LeftOutAt().has_value());
  book.TellLeftOut({});
  EXPECT_EQ(book.waiting_own(), 5U);
}

EventRecord AlarmEvent(AlarmMark::Step step, bool first = false) {
  EventRecord event;
  event.line = "bay";
  event.device = "relay";
  event.subject = "0:1";
  event.mark.step = step;
  event.mark.first = first;
  return event;
}

TEST(EventBook, FollowsAlarmsAsTheyAreKept) {
  using Step = AlarmMark::Step;
  EventBook book;
  Alarm kept;
  kept.line = "bay";
  kept.device = "relay";
  kept.name = "0:1";
  kept.state = AlarmState::active;
  kept.seq = 2;
  Batch before = BatchOf(1, "a", 0, true);  // came before the restart, and is kept
  before.events = {AlarmEvent(Step::clear)};
  book.Add(before);
  book.TellAlways(AlarmEvent(Step::raise, true));
  book.OnOpened(4, {{NameOf(1), "a"}}, {kept});
  EXPECT_THAT(Numbers(book.Prepare()), IsEmpty()) << "nothing of it is new";
  book.Kept(2);
  book.TellAlways(AlarmEvent(Step::acknowledge));
  book.TellAlways(AlarmEvent(Step::acknowledge));
  book.TellAlways(AlarmEvent(Step::clear));
  book.Prepare();
  const auto due = book.Prepare();
  EXPECT_THAT(Numbers(due), ElementsAre(5, 6)) << "acknowledged once; the same again";
  EXPECT_EQ(due[0].events[0].alarm->state, AlarmState::acknowledged);
  EXPECT_EQ(due[2].events[0].alarm->state, AlarmState::normal);
  EXPECT_EQ(book.alarms().size(), 1U) << "not before it is kept";
  EXPECT_EQ(book.alarms().begin()->second.state, AlarmState::active);
  book.Kept(3);
  EXPECT_TRUE(book.alarms().empty());
  EXPECT_EQ(book.newest(), 6);
  book.OnOpened(0, {}, {kept});
  EXPECT_TRUE(book.alarms().empty()) << "what it knows itself goes before";
}

}  // namespace
}  // namespace baudgate::events
