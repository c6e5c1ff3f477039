// The codes and words of the gateway's own events, which users filter by.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/own_records.h"

#include <gtest/gtest.h>

namespace baudgate::events {
namespace {

using config::EventState;

const WallTime kAt(1'790'000'000s);

TEST(OwnRecords, SayWhatALineHasComeTo) {
  struct Row {
    Fact fact;
    std::uint32_t code;
    EventState state;
    const char* text;
  };
  const Row rows[] = {
      {{OwnCode::port_down, false, "b", "", "unplugged"},
       1000005,
       EventState::on,
       "port down: unplugged"},
      {{OwnCode::port_down, true, "b"}, 1000005, EventState::off, "port open again"},
      {{OwnCode::port_lent, false, "b"}, 1000006, EventState::on, "port lent to another program"},
      {{OwnCode::port_lent, true, "b"}, 1000006, EventState::off, "port taken back"},
      {{OwnCode::collisions, false, "b"}, 1000007, EventState::on, "collisions"},
      {{OwnCode::collisions, true, "b"}, 1000007, EventState::off, "no collisions for a minute"},
      {{OwnCode::ring_open, false, "b"}, 1000008, EventState::on, "the ring is open"},
      {{OwnCode::ring_open, true, "b"}, 1000008, EventState::off, "the ring is closed again"},
      {{OwnCode::no_answer, false, "b", "d", "time is up"},
       1000009,
       EventState::on,
       "does not answer: time is up"},
      {{OwnCode::no_answer, true, "b", "d"}, 1000009, EventState::off, "answers again"},
      {{OwnCode::not_in_use, false, "b", "d", "taken out of use"},
       1000010,
       EventState::on,
       "taken out of use"},
      {{OwnCode::not_in_use, true, "b", "d"}, 1000010, EventState::off, "in use again"},
      {{OwnCode::wrong_device, false, "b", "d"}, 1000011, EventState::on, "not what it should be"},
      {{OwnCode::wrong_device, true, "b", "d"},
       1000011,
       EventState::off,
       "what it should be again"},
      {{OwnCode::replaced, false, "b", "d", "7 for 8"},
       1000012,
       EventState::message,
       "another device: 7 for 8"},
      {{OwnCode::clock_corrected, false, "b", "d", "it was 5.0 s ahead"},
       1000020,
       EventState::message,
       "clock corrected: it was 5.0 s ahead"},
      {{OwnCode::clock_left, false, "b", "d", "why"},
       1000021,
       EventState::message,
       "clock not corrected: why"},
  };
  for (const Row& row : rows) {
    const EventRecord record = FactRecord(row.fact, kAt);
    EXPECT_EQ(record.code, row.code);
    EXPECT_EQ(record.state, row.state) << row.text;
    EXPECT_EQ(record.text, row.text);
    EXPECT_EQ(record.line, "b");
    EXPECT_EQ(record.device, row.fact.device);
    EXPECT_EQ(record.clock, ClockQuality::gateway);
    EXPECT_EQ(record.received, kAt);
    EXPECT_EQ(record.device_time, kAt);
  }
}

TEST(OwnRecords, SayHowTheGatewayHasStartedAndEnded) {
  using End = LastRun::End;
  EXPECT_EQ(StartRecord("1", {}, kAt).text, "baudgate 1 has started");
  EXPECT_EQ(StartRecord("1", {End::in_order, kAt}, kAt).text,
            "baudgate 1 has started; the run before ended in order");
  EXPECT_EQ(StartRecord("1", {End::broken_off, kAt}, kAt).text,
            "baudgate 1 has started; the run before was broken off after " + FormatWallTime(kAt));
  EXPECT_EQ(StartRecord("1", {}, kAt).code, 1000001U);
  EXPECT_EQ(EndRecord(kAt).code, 1000002U);
  EXPECT_EQ(EndRecord(kAt).text, "the gateway ends");
  const EventRecord trouble = DiskTroubleRecord("/a/events.db", "/a/events.db: full", kAt, kAt);
  EXPECT_EQ(trouble.code, 1000004U);
  EXPECT_EQ(trouble.text, "no event could be kept since " + FormatWallTime(kAt) + ": full");
}

TEST(OwnRecords, SayWhatBecomesOfAnAlarm) {
  Alarm alarm;
  alarm.line = "b";
  alarm.device = "d";
  alarm.name = "current above 5";
  alarm.text = "current 8: above 5";
  alarm.seq = 7;
  const EventRecord seen = AckRecord(alarm, {.seq = 7, .by = "user:anna"}, kAt);
  EXPECT_EQ(seen.code, 1000016U);
  EXPECT_EQ(seen.text, "acknowledged by user:anna: current 8: above 5");
  EXPECT_EQ(seen.subject, alarm.name);
  EXPECT_EQ(seen.mark.step, AlarmMark::Step::acknowledge);
  EXPECT_EQ(seen.mark.by, "user:anna");
  EXPECT_EQ(seen.mark.seq, 7);
  const EventRecord gone = NotWatchedRecord(alarm, kAt);
  EXPECT_EQ(gone.code, 1000017U);
  EXPECT_EQ(gone.state, EventState::off);
  EXPECT_EQ(gone.text, "not in the configuration any more: current 8: above 5");
  EXPECT_EQ(gone.mark.step, AlarmMark::Step::clear);
  EXPECT_EQ(gone.line + "." + gone.device, "b.d");
}

TEST(OwnRecords, AreCutToWhatIsKept) {
  const Fact fact{OwnCode::port_down, false, "b", "", std::string(500, 'x')};
  EXPECT_EQ(FactRecord(fact, kAt).text.size(), kLongestText);
}

}  // namespace
}  // namespace baudgate::events
