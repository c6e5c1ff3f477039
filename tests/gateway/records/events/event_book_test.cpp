// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_book.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "gateway/records/events/event_log.h"
#include "gateway/records/events/event_queue.h"
#include "gateway/records/events/event_record.h"

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

TEST(EventBook, NumbersEventsWithoutAGapInTheirOrder) {
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

TEST(EventBook, ContinuesTheNumbersOfTheFile) {
  EventBook book;
  book.Add(BatchOf(0, "a", 1));
  book.OnOpened(41, {});
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(42));
  book.Kept(1);
  book.OnOpened(0, {});
  book.Add(BatchOf(0, "b", 1));
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(43)) << "in a new file no number comes twice";
}

TEST(EventBook, RecognisesRepeatedEvents) {
  EventBook book;
  book.OnOpened(7, {{NameOf(0), "a"}, {NameOf(1), "x"}});
  book.Add(BatchOf(0, "a", 2, true));
  book.Add(BatchOf(1, "y", 1, true));
  book.Add(BatchOf(2, "a", 1, true));
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

TEST(EventBook, AcceptsEventsDuringAWrite) {
  EventBook book;
  book.OnOpened(0, {});
  book.Add(BatchOf(0, "a", 1));
  const std::size_t written = book.Prepare().size();
  book.Add(BatchOf(1, "b", 1));
  EXPECT_THAT(book.Kept(written), ElementsAre(NameOf(0)));
  EXPECT_EQ(book.waiting(), 1U);
  EXPECT_THAT(Numbers(book.Prepare()), ElementsAre(2));
}

TEST(EventBook, AcceptsEventsOfTheGateway) {
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

TEST(EventBook, LimitsWaitingEventsOfTheGateway) {
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

TEST(EventBook, FollowsTheStoredAlarms) {
  using Step = AlarmMark::Step;
  EventBook book;
  Alarm kept;
  kept.line = "bay";
  kept.device = "relay";
  kept.name = "0:1";
  kept.state = AlarmState::active;
  kept.seq = 2;
  Batch before = BatchOf(1, "a", 0, true);
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

using config::EventState;

constexpr WallTime kHappened = WallTime(std::chrono::hours(498'000)) + 12s;

config::Device Relay() {
  config::Device device;
  device.name = "feeder-1";
  device.event_texts = {{std::nullopt, 1, EventState::on, "stage I> started"},
                        {2, 1, EventState::off, "blocking released"},
                        {std::nullopt, 51, EventState::message, "event register overflow"}};
  return device;
}

TEST(EventRecord, HasTheTextsOfTheProfile) {
  const protocols::SaidTime said{11s, 1min};
  const protocols::EventBatch batch{
      {{0, 1, said, ""}, {2, 1, said, ""}, {3, 51, said, "7"}, {0, 9, said, ""}, {0, 0, {}, "?"}},
      {},
      "",
      false,
      false};
  const auto records = RecordsOf(batch, "bay-1", Relay(), kHappened, 2s);
  ASSERT_EQ(records.size(), 5U);
  EXPECT_EQ(records[0].line, "bay-1");
  EXPECT_EQ(records[0].device, "feeder-1");
  EXPECT_EQ(records[0].received, kHappened);
  EXPECT_EQ(records[0].device_time, kHappened - 1s);
  EXPECT_EQ(records[0].clock, ClockQuality::device);
  EXPECT_EQ(records[0].text, "stage I> started");
  EXPECT_EQ(records[0].state, EventState::on);
  EXPECT_EQ(records[1].text, "blocking released") << "of its channel";
  EXPECT_EQ(records[1].state, EventState::off);
  EXPECT_EQ(records[2].text, "event register overflow: 7");
  EXPECT_EQ(records[3].text, "") << "not in the table";
  EXPECT_EQ(records[3].code, 9U);
  EXPECT_EQ(records[3].state, EventState::message);
  EXPECT_EQ(records[4].text, "?") << "what cannot be read";
  EXPECT_EQ(records[4].clock, ClockQuality::none);
  EXPECT_EQ(records[4].device_time, kHappened);
}

TEST(EventRecord, MarksItsAlarm) {
  config::Device relay = Relay();
  relay.event_texts[0].alarm = config::AlarmPriority::high;
  relay.event_texts[0].until = 2;
  relay.event_texts[2].alarm = config::AlarmPriority::low;
  const protocols::EventBatch batch{
      {{0, 1, {}, ""}, {3, 2, {}, ""}, {3, 51, {}, ""}, {2, 1, {}, ""}}, {}, "", false, false};
  const auto records = RecordsOf(batch, "bay-1", relay, kHappened, {});
  EXPECT_EQ(records[0].mark.step, AlarmMark::Step::raise);
  EXPECT_EQ(records[0].mark.priority, config::AlarmPriority::high);
  EXPECT_EQ(records[0].subject, "0:1");
  EXPECT_EQ(records[1].mark.step, AlarmMark::Step::clear);
  EXPECT_EQ(records[1].subject, "3:1") << "of its channel";
  EXPECT_EQ(records[2].mark.step, AlarmMark::Step::pulse) << "it has no end";
  EXPECT_EQ(records[3].mark.step, AlarmMark::Step::none) << "that of the channel is another";
}

TEST(EventRecord, CutsNoCharacterInTwo) {
  std::string text = std::string(kLongestText - 1, 'x') + "é";
  Shorten(text);
  EXPECT_EQ(text.size(), kLongestText - 1);
}

TEST(EventRecord, CutsLongTexts) {
  const protocols::EventBatch batch{{{0, 9, {}, std::string(1000, 'x')}}, {}, "", false, false};
  EXPECT_EQ(RecordsOf(batch, "l", Relay(), kHappened, {})[0].text.size(), kLongestText);
}

class EventRoundsTest : public ::testing::Test {
 protected:
  EventRoundsTest() {
    rounds_.OnOpened({.ok = true});
    EventRounds::Round first = rounds_.Take();
    rounds_.Done(first, {});
  }
  static LogOptions OptionsAt(const Instant& now) {
    LogOptions options;
    options.file = "/events.db";
    options.sources = {{"bay-1", "feeder-1"}};
    options.clocks = [&now] { return Now{now, {}}; };
    options.warn = options.inform = [](const std::string&) {};
    return options;
  }
  void Add(const std::string& said) {
    queue_.Add({.source = 0, .said = said, .events = {{}}, .line = "bay-1", .device = "feeder-1"});
  }

  Instant now_{1h};
  const LogOptions options_ = OptionsAt(now_);
  PendingEvents pending_{options_, [] {}};
  EventRounds rounds_{options_, pending_};
  EventQueue queue_{options_, pending_};
};

/// A device deletes the events of a confirmed batch, so only a stored batch is confirmed.
TEST_F(EventRoundsTest, ABatchIsConfirmedOnlyByASuccessfulRound) {
  Add("a");
  EventRounds::Round fails = rounds_.Take();
  EXPECT_THAT(rounds_.Done(fails, Error{"it is full"}), IsEmpty());
  EventRounds::Round next = rounds_.Take();
  ASSERT_EQ(next.batches.size(), 1U);
  EXPECT_EQ(next.batches[0].said, "a");
  EXPECT_THAT(rounds_.Done(next, {}), ElementsAre(0U));
}

TEST_F(EventRoundsTest, AFailingDiskIsRetriedAfterASecond) {
  Add("a");
  ASSERT_TRUE(rounds_.Begin());
  EventRounds::Round round = rounds_.Take();
  rounds_.Done(round, Error{"it is full"});
  EXPECT_FALSE(rounds_.Begin());
  EXPECT_EQ(rounds_.NextRound(), now_ + 1s);
  now_ += 1s;
  EXPECT_TRUE(rounds_.Begin());
}

constexpr Instant kNow = Instant() + 1h;

TEST(RoundTimerTest, WaitsOnlyForAFailingDiskOrForWork) {
  RoundTimer timer;
  EXPECT_EQ(timer.At(false, true, {}), kWhenWoken);
  EXPECT_LE(timer.At(false, false, {}), kNow) << "there is work";
  timer.Rest(kNow + 1s);
  EXPECT_EQ(timer.At(true, false, {}), kNow + 1s) << "the disk is left in peace";
  EXPECT_LE(timer.At(false, false, {}), kNow) << "it works again";
}

TEST(RoundTimerTest, TheEarliestLookIsUsed) {
  RoundTimer timer;
  timer.Look(kNow + 2s);
  timer.Look(kNow + 1s);
  timer.Look(kNow + 3s);
  EXPECT_EQ(timer.At(false, true, {}), kNow + 1s);
  EXPECT_EQ(timer.At(false, true, kNow + 500ms), kNow + 500ms) << "what was left out is told first";
  timer.Begin();
  EXPECT_EQ(timer.At(false, true, kNow + 4s), kNow + 4s);
}

}  // namespace
}  // namespace baudgate::events
