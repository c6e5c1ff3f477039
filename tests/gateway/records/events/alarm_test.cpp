// The states of an alarm, all of them.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/alarm.h"

#include <gmock/gmock.h>

#include "gateway/records/events/event_record.h"

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
  bool is_new = false;  // another occurrence
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

TEST(Alarm, IsRememberedWithWhoAcknowledgedIt) {
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

/// Who acknowledges event 3 has not seen event 5, which has raised it again.
TEST(Alarm, IsAcknowledgedAsItWasSeen) {
  EventRecord event = Event(Step::acknowledge);
  event.mark.seq = 2;
  EXPECT_FALSE(From(State::active, event).counts);
  event.mark.seq = 3;
  EXPECT_TRUE(From(State::active, event).counts);
}

TEST(Alarm, OfTheFirstReadingIsAnEventWhereTheKeptStateDiffers) {
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

TEST(Alarm, IsOfNoOtherEvent) {
  const AlarmChange change = From(State::active, Event(Step::none));
  EXPECT_TRUE(change.counts);
  EXPECT_FALSE(change.alarm);
}

}  // namespace
}  // namespace baudgate::events
