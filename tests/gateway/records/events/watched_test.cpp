// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/records/events/event_queue.h"

namespace baudgate::events {
namespace {

config::Config Configured() {
  config::PointEvent above;
  above.on = config::PointEvent::On::above;
  above.value = 5;
  above.alarm = config::AlarmPriority::high;
  config::PointEvent below = above;
  below.on = config::PointEvent::On::below;
  below.alarm = config::AlarmPriority::none;
  config::Point point;
  point.name = "current";
  point.events = {above, below};
  config::EventText trip;
  trip.code = 3;
  trip.alarm = config::AlarmPriority::high;
  config::EventText start;
  start.code = 1;
  config::Device device;
  device.name = "feeder-1";
  device.events = device.point_events = true;
  device.event_texts = {start, trip};
  device.points = {point};
  config::Device quiet = device;
  quiet.name = "feeder-2";
  quiet.events = quiet.point_events = false;
  config::Line line;
  line.name = "bay-1";
  line.devices = {device, quiet};
  line.devices[1].alarms.priority = config::AlarmPriority::none;
  config::Config config;
  config.lines = {line};
  config::Route route;
  route.first = route.last = 20;
  route.line = "bay-1";
  config.modbus.routes = {route};
  return config;
}

TEST(Watched, IsWhatTheConfigurationCanStillRaise) {
  const config::Config config = Configured();
  struct Row {
    const char* line;
    const char* device;
    const char* name;
    const char* point;
    bool watched;
  };
  const Row rows[] = {
      {"bay-1", "feeder-1", "current above 5", "current", true},
      {"bay-1", "feeder-1", "current above 6", "current", false},  // another limit
      {"bay-1", "feeder-1", "current below 5", "current", false},  // no alarm
      {"bay-1", "feeder-1", "voltage above 5", "voltage", false},
      {"bay-1", "feeder-1", "0:3", "", true},
      {"bay-1", "feeder-1", "2:3", "", true},   // the row is of all channels
      {"bay-1", "feeder-1", "0:1", "", false},  // no alarm
      {"bay-1", "feeder-1", "0:13", "", false},
      {"bay-1", "feeder-2", "current above 5", "current", false},  // events: off
      {"bay-1", "feeder-2", "0:3", "", false},
      {"bay-1", "feeder-3", "0:3", "", false},
      {"bay-2", "feeder-1", "0:3", "", false},  // it was there once
      {"bay-1", "feeder-1", "no answer", "", true},
      {"bay-1", "feeder-2", "no answer", "", false},  // alarms: off
      {"bay-1", "feeder-3", "no answer", "", false},
      {"bay-1", "", "port down", "", true},
      {"bay-2", "", "port down", "", false},
      {"bay-1", "unit-20", "no answer to clients", "", true},
      {"bay-1", "unit-21", "no answer to clients", "", false},
      {"", "", "events are not kept", "", true},
  };
  for (const Row& row : rows) {
    Alarm alarm;
    alarm.line = row.line;
    alarm.device = row.device;
    alarm.name = row.name;
    alarm.point = row.point;
    EXPECT_EQ(PriorityOf(config, alarm).has_value(), row.watched)
        << row.line << "." << row.device << " " << row.name;
  }
}

}  // namespace
}  // namespace baudgate::events
