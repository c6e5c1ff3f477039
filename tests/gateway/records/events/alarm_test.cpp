// Tests of the states of an alarm, of `AlarmBoard`, and of both when the power fails.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/alarm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <map>
#include <random>
#include <utility>

#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_record.h"
#include "gateway/records/events/event_source.h"
#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/support/long_run.h"

namespace baudgate::events {
namespace {

using Step = AlarmMark::Step;
using State = AlarmState;

EventRecord Event(Step step) {
  EventRecord event;
  event.seq = 7;
  event.received = WallTime(7s);
  event.device_time = WallTime(6s);
  event.line = "bay";
  event.device = "relay";
  event.subject = "0:1";
  event.text = "tripped";
  event.mark = {.step = step, .priority = config::AlarmPriority::high};
  return event;
}

Alarm AlarmIn(State state) {
  Alarm alarm;
  alarm.line = "bay";
  alarm.device = "relay";
  alarm.name = "0:1";
  alarm.state = state;
  alarm.seq = 3;
  alarm.text = "before";
  alarm.by = "user:anna";
  return alarm;
}

AlarmChange From(State state, const EventRecord& event) {
  const Alarm alarm = AlarmIn(state);
  return Apply(state == State::normal ? nullptr : &alarm, event);
}

struct Row {
  State before;
  Step step;
  State after;
  bool is_new = false;
};

TEST(Alarm, GoesThroughItsStates) {
  const Row rows[] = {
      {State::normal, Step::raise, State::active, true},
      {State::normal, Step::clear, State::normal},
      {State::normal, Step::pulse, State::returned, true},
      {State::active, Step::raise, State::active},
      {State::active, Step::clear, State::returned},
      {State::active, Step::pulse, State::active},
      {State::active, Step::acknowledge, State::acknowledged},
      {State::acknowledged, Step::raise, State::active, true},
      {State::acknowledged, Step::clear, State::normal},
      {State::acknowledged, Step::pulse, State::acknowledged},
      {State::returned, Step::raise, State::active, true},
      {State::returned, Step::clear, State::returned},
      {State::returned, Step::pulse, State::returned, true},
      {State::returned, Step::acknowledge, State::normal},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(std::string(Name(row.before)) + " " + std::to_string(static_cast<int>(row.step)));
    const AlarmChange change = From(row.before, Event(row.step));
    EXPECT_TRUE(change.counts);
    ASSERT_EQ(change.alarm.has_value(), row.before != row.after || row.is_new);
    if (!change.alarm) continue;
    EXPECT_EQ(change.alarm->state, row.after);
    EXPECT_EQ(change.alarm->changed, WallTime(7s));
    EXPECT_EQ(change.alarm->seq, row.is_new ? 7 : 3);
    EXPECT_EQ(change.alarm->text, row.is_new ? "tripped" : "before");
    EXPECT_EQ(change.alarm->key(), AlarmKey("bay", "relay", "0:1"));
  }
}

TEST(Alarm, RemembersTheUserWhoAcknowledged) {
  EventRecord event = Event(Step::acknowledge);
  event.mark.by = "user:bob";
  EXPECT_EQ(From(State::active, event).alarm->by, "user:bob");
  EXPECT_EQ(From(State::acknowledged, Event(Step::raise)).alarm->by, "") << "of another time";
}

TEST(Alarm, IsAcknowledgedOnce) {
  for (const State state : {State::normal, State::acknowledged}) {
    const AlarmChange change = From(state, Event(Step::acknowledge));
    EXPECT_FALSE(change.counts);
    EXPECT_FALSE(change.alarm);
  }
}

TEST(Alarm, AnAcknowledgementOfAnEarlierEventIsIgnored) {
  EventRecord event = Event(Step::acknowledge);
  event.mark.seq = 2;
  EXPECT_FALSE(From(State::active, event).counts);
  event.mark.seq = 3;
  EXPECT_TRUE(From(State::active, event).counts);
}

TEST(Alarm, TheWorstIsUnacknowledgedThenActiveThenOfPriorityThenNew) {
  using config::AlarmPriority;
  const auto alarm = [](State state, AlarmPriority priority, std::int64_t seq) {
    Alarm one;
    one.state = state;
    one.priority = priority;
    one.seq = seq;
    return one;
  };
  const std::vector<Alarm> worst_first = {alarm(State::active, AlarmPriority::high, 2),
                                          alarm(State::active, AlarmPriority::high, 1),
                                          alarm(State::active, AlarmPriority::low, 9),
                                          alarm(State::returned, AlarmPriority::high, 7),
                                          alarm(State::returned, AlarmPriority::low, 8),
                                          alarm(State::acknowledged, AlarmPriority::high, 3),
                                          alarm(State::acknowledged, AlarmPriority::medium, 10)};
  for (std::size_t i = 0; i + 1 < worst_first.size(); ++i) {
    EXPECT_TRUE(IsWorse(worst_first[i], worst_first[i + 1])) << i;
    EXPECT_FALSE(IsWorse(worst_first[i + 1], worst_first[i])) << i;
    EXPECT_FALSE(IsWorse(worst_first[i], worst_first[i])) << i;
  }
}

TEST(Alarm, TheFirstReadingIsAnEventIfTheStoredStateDiffers) {
  const auto counts = [](State state, Step step) {
    EventRecord event = Event(step);
    event.mark.first = true;
    return From(state, event).counts;
  };
  EXPECT_TRUE(counts(State::normal, Step::raise));
  EXPECT_FALSE(counts(State::normal, Step::clear));
  EXPECT_FALSE(counts(State::active, Step::raise));
  EXPECT_TRUE(counts(State::active, Step::clear));
  EXPECT_FALSE(counts(State::acknowledged, Step::raise)) << "it was seen before the restart";
  EXPECT_TRUE(counts(State::acknowledged, Step::clear));
  EXPECT_TRUE(counts(State::returned, Step::raise));
  EXPECT_FALSE(counts(State::returned, Step::clear));
}

TEST(Alarm, AnEventWithoutAMarkChangesNoAlarm) {
  const AlarmChange change = From(State::active, Event(Step::none));
  EXPECT_TRUE(change.counts);
  EXPECT_FALSE(change.alarm);
}

Alarm AlarmOf(const std::string& name, AlarmState state) {
  Alarm alarm;
  alarm.name = name;
  alarm.state = state;
  return alarm;
}

TEST(AlarmBoard, ReturnsTheCurrentStateOfEachAlarm) {
  AlarmBoard board;
  board.Update(AlarmOf("a", AlarmState::active));
  board.Update(AlarmOf("b", AlarmState::active));
  board.Update(AlarmOf("a", AlarmState::acknowledged));
  const auto all = board.Take(0, 10);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].alarm.name, "b");
  EXPECT_EQ(all[1].alarm.state, AlarmState::acknowledged);
  EXPECT_EQ(board.Take(0, 1).size(), 1U);
  EXPECT_EQ(board.Take(2, 10).size(), 1U);
  EXPECT_TRUE(board.Take(3, 10).empty());
  board.Update(AlarmOf("a", AlarmState::normal));
  EXPECT_EQ(board.Take(3, 10).front().alarm.state, AlarmState::normal) << "its end is told";
}

TEST(AlarmBoard, ForgetsEndedAlarmsFirst) {
  AlarmBoard board;
  for (std::size_t i = 0; i < AlarmBoard::kMost; ++i) {
    board.Update(AlarmOf(std::to_string(i), i % 2 == 0 ? AlarmState::active : AlarmState::normal));
  }
  board.Update(AlarmOf("new", AlarmState::active));
  const auto all = board.Take(0, 2 * AlarmBoard::kMost);
  EXPECT_EQ(all.size(), AlarmBoard::kMost);
  EXPECT_EQ(all[0].alarm.name, "0");
  EXPECT_EQ(all[1].alarm.name, "2");
}

// ---------------- Random power cuts. The alarms in the file must fit its events, and no stored
// event is lost.

using audit::FaultyDisk;

const std::size_t kSeeds = LongRun(300);
constexpr int kLives = 4;
constexpr Step kSteps[] = {Step::raise, Step::clear, Step::pulse, Step::acknowledge};

EventRecord Event(std::mt19937& random) {
  EventRecord event;
  event.line = "bay";
  event.device = "relay";
  event.subject = std::to_string(random() % 5);
  const auto step = random() % 4;
  event.text = std::to_string(step) + " of " + event.subject;
  event.mark.step = kSteps[step];
  event.mark.first = kSteps[step] != Step::acknowledge && random() % 8 == 0;
  return event;
}

class Life {
 public:
  Life(FaultyDisk& disk, std::mt19937& random)
      : disk_(disk), random_(random), file_(audit::kEventsFile, disk.vfs()) {}

  std::int64_t Run() {
    disk_.power_left = static_cast<int>(1 + random_() % 250);
    while (!disk_.power_failed()) {
      for (auto count = random_() % 4; count > 0; --count) Add();
      Write();
      disk_.write_error = random_() % 50 == 0 ? SQLITE_FULL : 0;
      disk_.sync_error = random_() % 50 == 0 ? SQLITE_IOERR_FSYNC : 0;
    }
    disk_.write_error = disk_.sync_error = 0;
    return book_.newest();
  }

 private:
  void Add() {
    if (random_() % 2 == 0) return book_.TellAlways(Event(random_));
    book_.Add(
        {0, std::to_string(random_() % 3), random_() % 2 == 0, {Event(random_), Event(random_)}});
  }
  void Write() {
    if (const auto opened = file_.Open()) {
      if (!opened->ok) return;
      book_.OnOpened(opened->contents.last, opened->contents.said, opened->contents.alarms);
    }
    const auto due = book_.Prepare();
    if (file_.Write(due)) book_.Kept(due.size());
  }

  FaultyDisk& disk_;
  std::mt19937& random_;
  EventBook book_;
  EventFile file_;
};

using States = std::map<std::string, std::pair<AlarmState, std::int64_t>>;
States Follow(const std::vector<EventRecord>& events) {
  States states;
  for (const EventRecord& event : events) {
    const std::string name = event.text.substr(event.text.size() - 1);
    auto& [state, seq] = states[name];
    const Step step = kSteps[event.text[0] - '0'];
    const bool active = IsActive(state);
    if (step == Step::raise && state != AlarmState::active) {
      state = AlarmState::active;
      seq = event.seq;
    } else if (step == Step::pulse && !active) {
      state = AlarmState::returned;
      seq = event.seq;
    } else if (step == Step::clear && active) {
      state = state == AlarmState::active ? AlarmState::returned : AlarmState::normal;
    } else if (step == Step::acknowledge) {
      EXPECT_TRUE(IsUnacknowledged(state)) << "acknowledged twice: event " << event.seq;
      state = active ? AlarmState::acknowledged : AlarmState::normal;
    }
  }
  std::erase_if(states, [](const auto& one) { return one.second.first == AlarmState::normal; });
  return states;
}

std::vector<EventRecord> ReadAll(const std::string& vfs) {
  records::Database database(audit::kEventsFile, records::Database::Mode::read, vfs);
  std::vector<EventRecord> all;
  PageQuery query;
  for (bool more = true; more;) {
    auto page = ReadPage(database, query);
    if (!page) {
      ADD_FAILURE() << page.error();
      break;
    }
    all.insert(all.end(), page->records.begin(), page->records.end());
    query.after = page->next;
    more = page->more;
  }
  return all;
}

TEST(AlarmCut, LeavesAlarmsThatMatchTheirEvents) {
  std::size_t events = 0;
  std::size_t alarms = 0;
  for (unsigned seed = 1; seed <= kSeeds && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    FaultyDisk disk;
    for (int life = 0; life < kLives; ++life) {
      const std::int64_t kept = Life(disk, random).Run();
      disk.Restore(random);
      EventFile file(audit::kEventsFile, disk.vfs());
      const auto opened = file.Open();
      ASSERT_TRUE(opened && opened->ok) << opened->error;
      EXPECT_TRUE(opened->put_aside.empty()) << opened->put_aside;
      EXPECT_GE(opened->contents.last, kept);
      const auto records = ReadAll(disk.vfs());
      States states;
      for (const Alarm& alarm : opened->contents.alarms) {
        states[alarm.name] = {alarm.state, alarm.seq};
      }
      EXPECT_EQ(states, Follow(records));
      events += records.size();
      alarms += states.size();
    }
  }
  EXPECT_GT(events, 20U * kSeeds) << "there was something to be lost";
  EXPECT_GT(alarms, 1U * kSeeds);
}

}  // namespace
}  // namespace baudgate::events
