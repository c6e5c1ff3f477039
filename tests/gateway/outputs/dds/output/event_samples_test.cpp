// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/output/event_samples.h"

#include <gtest/gtest.h>

namespace baudgate::dds {
namespace {

events::EventRecord Event(std::int64_t seq, const std::string& line, const std::string& device) {
  events::EventRecord event;
  event.seq = seq;
  event.line = line;
  event.device = device;
  event.text = "what it is";
  return event;
}

TEST(EventSamples, NameTheDeviceLineOrGatewayOfTheEvent) {
  const auto feed = std::make_shared<events::EventFeed>();
  feed->Renumber({{"bay-1", "feeder-1"}});
  feed->Add({Event(1, "bay-1", "feeder-1"), Event(2, "bay-1", ""), Event(3, "", ""),
             Event(4, "bay-1", "gone")});
  const auto samples = EventSamples("plant", feed, nullptr).Take(0, 10);
  ASSERT_EQ(samples.size(), 4U);
  EXPECT_EQ(samples[0].gateway, "plant");
  EXPECT_EQ(samples[0].device, "feeder-1");
  EXPECT_EQ(samples[0].text, "what it is");
  EXPECT_EQ(samples[1].gateway, "plant");
  EXPECT_EQ(samples[1].device, "");
  EXPECT_EQ(samples[1].text, "line bay-1: what it is");
  EXPECT_EQ(samples[2].gateway, "plant");
  EXPECT_EQ(samples[2].text, "what it is");
  EXPECT_EQ(samples[3].gateway, "") << "not configured any more: not published";
}

TEST(EventSamples, StoreTheirPositionAmongTheEvents) {
  const auto cursors =
      std::make_shared<events::CursorBook>(std::set<std::string>{EventSamples::kConsumer});
  EventSamples samples("plant", std::make_shared<events::EventFeed>(), cursors);
  EXPECT_FALSE(samples.place());
  samples.Keep({7, true});
  EXPECT_EQ(cursors->Of("dds"), (events::Cursor{7, true}));
  EXPECT_EQ(samples.place()->seq, 7U);
  EXPECT_TRUE(samples.place()->sure);
}

TEST(EventSamples, AreOnlyAlarmsWhereEventsAreOff) {
  const auto feed = std::make_shared<events::EventFeed>();
  events::EventRecord event = Event(1, "bay-1", "feeder-1");
  event.alarm.emplace().seq = 1;
  feed->Add({event});
  EventSamples samples("plant", feed, nullptr, false);
  EXPECT_TRUE(samples.Take(0, 10).empty());
  EXPECT_EQ(samples.newest(), 0U);
  EXPECT_EQ(samples.TakeAlarms(0, 10).size(), 1U);
}

TEST(EventSamples, OfAlarmsHaveTheCurrentState) {
  const auto feed = std::make_shared<events::EventFeed>();
  events::EventRecord event = Event(4, "bay-1", "feeder-1");
  events::Alarm& alarm = event.alarm.emplace();
  alarm.line = "bay-1";
  alarm.device = "feeder-1";
  alarm.name = "current above 5";
  alarm.point = "current";
  alarm.state = events::AlarmState::acknowledged;
  alarm.priority = config::AlarmPriority::high;
  alarm.seq = 4;
  alarm.raised = WallTime(5s);
  alarm.changed = WallTime(6s);
  alarm.text = "current 8: above 5";
  alarm.by = "modbus 10.0.0.7:40112";
  feed->Add({event});
  EventSamples samples("plant", feed, nullptr);
  const auto alarms = samples.TakeAlarms(0, 10);
  ASSERT_EQ(alarms.size(), 1U);
  EXPECT_EQ(alarms[0].sample, (dds::AlarmSample{.gateway = "plant",
                                                .line = "bay-1",
                                                .device = "feeder-1",
                                                .name = "current above 5",
                                                .point = "current",
                                                .state = 2,
                                                .priority = 3,
                                                .seq = 4,
                                                .raised_time_ns = 5'000'000'000,
                                                .changed_time_ns = 6'000'000'000,
                                                .text = "current 8: above 5",
                                                .acknowledged_by = "modbus 10.0.0.7:40112"}));
  EXPECT_TRUE(samples.TakeAlarms(alarms[0].version, 10).empty());
}

}  // namespace
}  // namespace baudgate::dds
