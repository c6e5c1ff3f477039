// Which samples `watch` prints, and as what JSON.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/watch/watch_lines.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "gateway/tools/watch/point_feed.h"

namespace baudgate {
namespace {

PointEvent Reading() {
  PointEvent event;
  event.sample.value = 2.5;
  event.sample.quality = 0xC0;
  event.sample.seq = 7;
  return event;
}

TEST(WatchLines, TellNewsFromRepeats) {
  const struct {
    const char* what;
    std::function<void(PointEvent&)> change;
    bool same_reading;
    bool looks_alike;
  } rows[] = {
      {"a heartbeat", [](PointEvent&) {}, true, true},
      {"read once more", [](PointEvent& event) { event.sample.seq = 8; }, false, true},
      {"another value", [](PointEvent& event) { event.sample.value = 3; }, false, false},
      {"another text", [](PointEvent& event) { event.sample.text = "3"; }, false, false},
      {"another quality", [](PointEvent& event) { event.sample.quality = 0x18; }, false, false},
      {"gone", [](PointEvent& event) { event.gone = dds::Gone::no_writers; }, false, false},
  };
  for (const auto& row : rows) {
    PointEvent now = Reading();
    row.change(now);
    EXPECT_EQ(IsSameReading(Reading(), now), row.same_reading) << row.what;
    EXPECT_EQ(LooksAlike(Reading(), now), row.looks_alike) << row.what;
  }
  PointEvent unread;
  unread.sample.value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(LooksAlike(unread, unread)) << "no value is no news either";
}

TEST(WatchLines, JsonHasEachFieldOfTheContract) {
  PointEvent event = Reading();
  event.sample.gateway = "g", event.sample.device = "d", event.sample.point = "p";
  event.sample.unit = "A", event.sample.rtt_us = 9;
  event.sample.source_time_ns = 1'790'000'000'000'000'000;
  const std::string end = R"(,"writer":")" + Text(event.origin.writer) + R"("})";
  EXPECT_EQ(JsonLine(event),
            R"({"gateway":"g","device":"d","point":"p","value":2.5,"unit":"A","quality":192,)"
            R"("quality_text":"good","source_time":"2026-09-21T14:13:20.000Z","seq":7,"rtt_us":9)" +
                end);
  event.gone = dds::Gone::no_writers;
  EXPECT_EQ(JsonLine(event), R"({"gateway":"g","device":"d","point":"p","gone":"no_writers"})");

  dds::EventSample happened;
  happened.gateway = "g", happened.device = "d", happened.seq = 412, happened.code = 49;
  happened.device_time_ns = 1'790'000'000'000'000'000, happened.text = "tripped";
  EXPECT_EQ(JsonLine(happened),
            R"({"gateway":"g","device":"d","seq":412,"device_time":"2026-09-21T14:13:20.000Z",)"
            R"("receive_time":null,"clock_quality":0,"channel":0,"code":49,"text":"tripped"})");

  dds::AlarmSample alarm;
  alarm.gateway = "g", alarm.line = "l", alarm.device = "d", alarm.name = "n";
  alarm.state = 3, alarm.priority = 3, alarm.seq = 412, alarm.text = "tripped";
  alarm.raised_time_ns = alarm.changed_time_ns = 1'790'000'000'000'000'000;
  EXPECT_EQ(JsonLine(alarm),
            R"({"gateway":"g","line":"l","device":"d","name":"n","point":"","state":"returned",)"
            R"("priority":"high","seq":412,"raised":"2026-09-21T14:13:20.000Z",)"
            R"("changed":"2026-09-21T14:13:20.000Z","text":"tripped","acknowledged_by":""})");
}

}  // namespace
}  // namespace baudgate
