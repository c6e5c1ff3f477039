// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_record.h"

#include <gtest/gtest.h>

namespace baudgate::events {
namespace {

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

TEST(EventRecord, HasTheWordsOfTheProfile) {
  const SaidTime said{11s, 1min};
  const EventBatch batch{
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
  const EventBatch batch{
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
  const EventBatch batch{{{0, 9, {}, std::string(1000, 'x')}}, {}, "", false, false};
  EXPECT_EQ(RecordsOf(batch, "l", Relay(), kHappened, {})[0].text.size(), kLongestText);
}

}  // namespace
}  // namespace baudgate::events
